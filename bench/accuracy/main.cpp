// How far Instant Radiosity is from the path tracer: both sum the same light by different means.
//
// Samples of both go through the pixels' centres: with few samples for antialiasing the edge of a visible lamp alone
// would hide what is asked. Pixels where the clamp takes more than a share of the light (measured without visibility,
// over the same VPLs) are told apart, for that bias is known and another question.

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "backend/scene_arrays.h"
#include "cpu/path_tracer.h"
#include "lightcuts/compare.h"
#include "lightcuts/io.h"
#include "lightcuts/render.h"

namespace lightcuts {
namespace {

/// Two halves of a path-traced picture: their mean is the reference, their difference tells its noise.
struct Reference {
  Image first, second, mean;
};

Reference trace_reference(const Scene& scene, const Camera& camera, int width, int height, std::uint32_t samples) {
  const SceneArrays arrays(scene);
  const RayTracer tracer(arrays.view());
  const EmitterTable emitters(arrays);
  const PathTracer paths(arrays, emitters, tracer, kUnlimitedBounces, 1);
  const CameraView view = make_camera_view(camera, width, height);
  Reference r{make_rgb_image(width, height), make_rgb_image(width, height), make_rgb_image(width, height)};
  tbb::parallel_for(0, width * height, [&](int i) {
    const int column = i % width, row = i / width;
    const auto x = static_cast<float>(column), y = static_cast<float>(row);
    const Ray ray = camera_ray(view, x + 0.5f, y + 0.5f);
    Vec3T<double> sums[2];
    for (std::uint32_t s = 0; s < samples; ++s) {
      const Vec3 radiance = paths.radiance_along(ray, static_cast<std::uint32_t>(i) * samples + s);
      sums[2 * s / samples] += Vec3T<double>{radiance.x, radiance.y, radiance.z};
    }
    const auto put = [&](Image& image, Vec3T<double> sum, double count) {
      const double values[3] = {sum.x / count, sum.y / count, sum.z / count};
      for (std::size_t c = 0; c < 3; ++c) {
        image.channels[c].values[static_cast<std::size_t>(i)] = static_cast<float>(values[c]);
      }
    };
    put(r.first, sums[0], samples / 2.0);
    put(r.second, sums[1], samples / 2.0);
    put(r.mean, sums[0] + sums[1], samples);
  });
  return r;
}

double mean_luminance(const std::vector<Vec3>& pixels) {
  double sum = 0;
  for (const Vec3& v : pixels) sum += luminance(v);
  return sum / static_cast<double>(pixels.size());
}

/// relMSE as `lightcuts compare` has it, over the pixels that `counts` keeps.
template <class Counts>
double relmse(const Image& image, const Image& reference, const Counts& counts) {
  const std::vector<Vec3> a = rgb_pixels(image), b = rgb_pixels(reference);
  const double mean = mean_luminance(b);
  double sum = 0, kept = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!counts(i)) continue;
    ++kept;
    for (const auto c : {&Vec3::x, &Vec3::y, &Vec3::z}) {
      const double d = static_cast<double>(a[i].*c) - b[i].*c;
      sum += d * d / (static_cast<double>(b[i].*c) * (b[i].*c) + 0.01 * mean * mean);
    }
  }
  return kept > 0 ? sum / (3 * kept) : 0;
}

struct Estimate {
  double value = 0, standard_error = 0;
};

/// What pictures of several seeds have for an error, without the reference's noise.
struct Errors {
  Estimate one;  ///< of one picture, in the mean over the seeds
  double shared =
      0;  ///< the part that all seeds share: of their mean, with endlessly many seeds. NaN for a single seed
};

/// The product of the differences from two independent halves of the reference has the square of the difference from
/// the truth as its mean; so has, for the part that seeds share, the product of the differences of two seeds. The mean
/// over the seeds, which has little noise, is the denominator.
template <class Counts>
Errors errors_without_noise(const std::vector<Image>& images, const Reference& reference, const Counts& counts) {
  std::vector<std::vector<Vec3>> seeds;
  seeds.reserve(images.size());
  for (const Image& image : images) seeds.push_back(rgb_pixels(image));
  const std::vector<Vec3> b = rgb_pixels(reference.first), c = rgb_pixels(reference.second);
  const double mean = mean_luminance(rgb_pixels(reference.mean)), n = static_cast<double>(seeds.size());
  double sum = 0, squares = 0, shared = 0, kept = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    if (!counts(i)) continue;
    double pixel = 0;
    for (const auto k : {&Vec3::x, &Vec3::y, &Vec3::z}) {
      double average = 0, products = 0, to_b = 0, to_c = 0;
      for (const std::vector<Vec3>& a : seeds) {
        const double v = a[i].*k, from_b = v - b[i].*k, from_c = v - c[i].*k;
        average += v / n, products += from_b * from_c, to_b += from_b, to_c += from_c;
      }
      const double scale = 1 / (3 * (average * average + 0.01 * mean * mean));
      pixel += products / n * scale;
      if (n > 1) shared += (to_b * to_c - products) / (n * (n - 1)) * scale;
    }
    ++kept;
    sum += pixel;
    squares += pixel * pixel;
  }
  if (kept < 2) return {};
  const double average = sum / kept;
  return {{average, std::sqrt(std::max(0.0, squares / kept - average * average) / (kept - 1))},
          n > 1 ? shared / kept : std::numeric_limits<double>::quiet_NaN()};
}

/// Mean of the image over that of the reference, in luminance.
double ratio_of_means(const Image& image, const Image& reference) {
  return mean_luminance(rgb_pixels(image)) / mean_luminance(rgb_pixels(reference));
}

struct Request {
  std::string scene, camera, environment, output, placement = "power", backend = "cpu";
  int size = 256;
  std::uint32_t samples = 1024;
  std::vector<std::uint64_t> vpls{1000, 10000, 100000};
  std::uint64_t seeds = 1, many = 0;
  float min_distance = 0.01f;
};

RenderOptions options_of(const Request& request, std::uint64_t vpls, std::uint64_t seed) {
  RenderOptions options;
  options.width = options.height = request.size;
  options.vpls.count = vpls;
  options.vpls.seed = options.shade.seed = seed;
  options.vpls.placement = request.placement == "camera" ? VplPlacement::camera : VplPlacement::power;
  options.backend = request.backend == "cuda" ? BackendKind::cuda : BackendKind::cpu;
  options.shade.method = Method::instant_radiosity;
  options.shade.min_distance = request.min_distance;
  return options;
}

/// A reference that has the clamp's bias: two pictures by very many VPLs of seeds of their own.
Reference sum_many(const Scene& scene, const Camera& camera, const Request& request) {
  Reference r;
  r.first = render(scene, camera, options_of(request, request.many, 1000001)).image;
  r.second = render(scene, camera, options_of(request, request.many, 1000002)).image;
  r.mean = r.first;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<float>& values = r.mean.channels[c].values;
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = 0.5f * (values[i] + r.second.channels[c].values[i]);
  }
  return r;
}

Scene open_scene(const std::string& name) {
  constexpr std::string_view builtin = "builtin:";
  if (name.rfind(builtin, 0) != 0) return load_scene(name).scene;
  Scene scene = make_builtin_scene(name.substr(builtin.size()));
  validate(scene);
  return scene;
}

void run(const Request& request) {
  const Scene scene = open_scene(request.scene);
  const Camera camera = select_camera(scene, request.camera);
  const Reference reference = request.many > 0
                                  ? sum_many(scene, camera, request)
                                  : trace_reference(scene, camera, request.size, request.size, request.samples);
  const auto all = [](std::size_t) { return true; };
  // Half the mean square difference of two halves is one half's variance; the mean of both has half of that again.
  const double noise = relmse(reference.first, reference.second, all) / 4;
  for (const std::uint64_t count : request.vpls) {
    std::vector<Image> lit;
    std::uint64_t made = 0;
    double relmse_all = 0, ratio = 0;
    const auto seeds = static_cast<double>(request.seeds);
    for (std::uint64_t seed = 1; seed <= request.seeds; ++seed) {
      RenderResult result = render(scene, camera, options_of(request, count, seed));
      made = result.statistics.vpls.count;
      relmse_all += compare(result.image, reference.mean).relmse / seeds;
      ratio += ratio_of_means(result.image, reference.mean) / seeds;
      lit.push_back(std::move(result.image));
    }
    RenderOptions options = options_of(request, count, 1);
    options.shade.visibility = Visibility::none;
    const std::vector<Vec3> clamped = rgb_pixels(render(scene, camera, options).image);
    options.shade.min_distance = 0;
    const std::vector<Vec3> unclamped = rgb_pixels(render(scene, camera, options).image);
    std::size_t kept_count = 0;
    // With the same clamp in the reference every pixel counts.
    const auto away = [&](std::size_t i) {
      return request.many > 0 || luminance(clamped[i]) >= 0.98f * luminance(unclamped[i]);
    };
    for (std::size_t i = 0; i < clamped.size(); ++i) kept_count += away(i) ? 1 : 0;
    double relmse_away = 0;
    for (const Image& image : lit) relmse_away += relmse(image, reference.mean, away) / seeds;
    const Errors errors = errors_without_noise(lit, reference, away);
    fmt::print("| {} | {} | {:.5f} | {:.5f} | {:.5f} | {:.5f} ± {:.5f} | {:.5f} | {:.1f} % | {:.4f} |\n", request.scene,
               made, relmse_all, relmse_away, noise, errors.one.value, errors.one.standard_error, errors.shared,
               100 - 100.0 * static_cast<double>(kept_count) / static_cast<double>(clamped.size()), ratio);
    std::fflush(stdout);
    if (!request.output.empty()) save_image(fmt::format("{}-{}.exr", request.output, count), lit.front());
  }
  if (!request.output.empty()) save_image(request.output + "-path.exr", reference.mean);
}

}  // namespace
}  // namespace lightcuts

int main(int argc, char** argv) {
  try {
    lightcuts::Request request;
    CLI::App app("Instant Radiosity with shadow rays against the path tracer, a Markdown row a number of VPLs");
    app.add_option("scene", request.scene, "a scene file or builtin:NAME")->required();
    app.add_option("--camera", request.camera, "camera by name or number");
    app.add_option("--size", request.size, "pixels a side")->capture_default_str();
    app.add_option("--samples", request.samples, "paths a pixel of the reference, even")->capture_default_str();
    app.add_option("--vpls", request.vpls, "numbers of VPLs")->capture_default_str();
    app.add_option("--min-distance", request.min_distance, "clamp, as a fraction of the scene's diagonal");
    app.add_option("--seeds", request.seeds, "pictures of different seeds a row")->capture_default_str();
    app.add_option("--many", request.many,
                   "compare with the sum over so many VPLs, twice, with the same clamp, instead of with paths");
    app.add_option("--vpl-placement", request.placement, "power or camera")->check(CLI::IsMember({"power", "camera"}));
    app.add_option("--backend", request.backend, "of the sums over VPLs")->check(CLI::IsMember({"cpu", "cuda"}));
    app.add_option("--output", request.output, "write PREFIX-N.exr and PREFIX-path.exr");
    CLI11_PARSE(app, argc, argv);
    fmt::print(
        "| scene | VPLs | relmse | away from the clamp | the reference's noise in it | away, without that noise "
        "| of it shared by all seeds | clamped pixels | mean / reference's |\n"
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|\n");
    lightcuts::run(request);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
