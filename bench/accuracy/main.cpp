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

#include "cpu/cpu_scene.h"
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
  const CpuScene arrays(scene);
  const RayTracer tracer(arrays.view());
  const EmitterTable emitters(arrays);
  const PathTracer paths(arrays, emitters, tracer, kUnlimitedBounces, 1);
  const CameraView view = make_camera_view(camera, width, height);
  Reference r{make_rgb_image(width, height), make_rgb_image(width, height), make_rgb_image(width, height)};
  tbb::parallel_for(0, width * height, [&](int i) {
    const auto x = static_cast<float>(i % width), y = static_cast<float>(i / width);
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

/// relMSE without the reference's noise: the product of the differences from two independent halves has the square of
/// the difference from the truth as its mean. The image, which has little noise, is the denominator.
template <class Counts>
Estimate relmse_without_noise(const Image& image, const Reference& reference, const Counts& counts) {
  const std::vector<Vec3> a = rgb_pixels(image), b = rgb_pixels(reference.first), c = rgb_pixels(reference.second);
  const double mean = mean_luminance(rgb_pixels(reference.mean));
  double sum = 0, squares = 0, kept = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!counts(i)) continue;
    double pixel = 0;
    for (const auto k : {&Vec3::x, &Vec3::y, &Vec3::z}) {
      const double v = a[i].*k;
      pixel += (v - b[i].*k) * (v - c[i].*k) / (v * v + 0.01 * mean * mean) / 3;
    }
    ++kept;
    sum += pixel;
    squares += pixel * pixel;
  }
  if (kept < 2) return {};
  const double average = sum / kept;
  return {average, std::sqrt(std::max(0.0, squares / kept - average * average) / (kept - 1))};
}

/// Mean of the image over that of the reference, in luminance.
double ratio_of_means(const Image& image, const Image& reference) {
  return mean_luminance(rgb_pixels(image)) / mean_luminance(rgb_pixels(reference));
}

struct Request {
  std::string scene, camera, environment, output;
  int size = 256;
  std::uint32_t samples = 1024;
  std::vector<std::uint64_t> vpls{1000, 10000, 100000};
  float min_distance = 0.01f;
};

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
  const Reference reference = trace_reference(scene, camera, request.size, request.size, request.samples);
  const auto all = [](std::size_t) { return true; };
  // Half the mean square difference of two halves is one half's variance; the mean of both has half of that again.
  const double noise = relmse(reference.first, reference.second, all) / 4;
  for (const std::uint64_t count : request.vpls) {
    RenderOptions options;
    options.width = options.height = request.size;
    options.vpls.count = count;
    options.shade.method = Method::instant_radiosity;
    options.shade.min_distance = request.min_distance;
    const RenderResult lit = render(scene, camera, options);

    options.shade.visibility = Visibility::none;
    const std::vector<Vec3> clamped = rgb_pixels(render(scene, camera, options).image);
    options.shade.min_distance = 0;
    const std::vector<Vec3> unclamped = rgb_pixels(render(scene, camera, options).image);
    std::size_t kept_count = 0;
    const auto away = [&](std::size_t i) { return luminance(clamped[i]) >= 0.98f * luminance(unclamped[i]); };
    for (std::size_t i = 0; i < clamped.size(); ++i) kept_count += away(i) ? 1 : 0;

    const Comparison comparison = compare(lit.image, reference.mean);
    const Estimate truth = relmse_without_noise(lit.image, reference, away);
    fmt::print("| {} | {} | {:.5f} | {:.5f} | {:.5f} | {:.5f} ± {:.5f} | {:.1f} % | {:.4f} |\n", request.scene,
               lit.statistics.vpls.count, comparison.relmse, relmse(lit.image, reference.mean, away), noise,
               truth.value, truth.standard_error,
               100 - 100.0 * static_cast<double>(kept_count) / static_cast<double>(clamped.size()),
               ratio_of_means(lit.image, reference.mean));
    std::fflush(stdout);
    if (!request.output.empty()) save_image(fmt::format("{}-{}.exr", request.output, count), lit.image);
  }
  if (!request.output.empty()) save_image(request.output + "-path.exr", reference.mean);
}

}  // namespace
}  // namespace lightcuts

int main(int argc, char** argv) {
  lightcuts::Request request;
  CLI::App app("Instant Radiosity with shadow rays against the path tracer, a Markdown row a number of VPLs");
  app.add_option("scene", request.scene, "a scene file or builtin:NAME")->required();
  app.add_option("--camera", request.camera, "camera by name or number");
  app.add_option("--size", request.size, "pixels a side")->capture_default_str();
  app.add_option("--samples", request.samples, "paths a pixel of the reference, even")->capture_default_str();
  app.add_option("--vpls", request.vpls, "numbers of VPLs")->capture_default_str();
  app.add_option("--min-distance", request.min_distance, "clamp, as a fraction of the scene's diagonal");
  app.add_option("--output", request.output, "write PREFIX-N.exr and PREFIX-path.exr");
  CLI11_PARSE(app, argc, argv);
  fmt::print(
      "| scene | VPLs | relmse | away from the clamp | the reference's noise in it | away, without that noise | "
      "clamped pixels | mean / reference's |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|\n");
  try {
    lightcuts::run(request);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
