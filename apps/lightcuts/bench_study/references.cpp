#include "bench_study/references.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "backend/scene_arrays.h"
#include "cpu/path_tracer.h"

namespace lightcuts::app::study {

Halves trace_centres(const Scene& scene, const Camera& camera, int side, std::uint32_t samples,
                     const ProgressFn& progress) {
  const SceneArrays arrays(scene);
  const RayTracer tracer(arrays.view());
  const EmitterTable emitters(arrays);
  const PathTracer paths(arrays, emitters, tracer, kUnlimitedBounces, 7);
  const CameraView view = make_camera_view(camera, side, side);
  Halves halves{make_rgb_image(side, side), make_rgb_image(side, side)};
  tbb::parallel_for(0, side * side, [&](int i) {
    if (progress && !progress("reference", 0)) return;
    const int x = i % side, y = i / side;
    const Ray ray = camera_ray(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    for (std::uint32_t half = 0; half < 2; ++half) {
      Vec3T<double> sum;
      for (std::uint32_t s = 0; s < samples; ++s) {
        const Vec3 radiance = paths.radiance_along(ray, (static_cast<std::uint32_t>(i) * 2 + half) * samples + s);
        sum += Vec3T<double>{radiance.x, radiance.y, radiance.z};
      }
      Image& image = half == 0 ? halves.first : halves.second;
      const double values[3] = {sum.x, sum.y, sum.z};
      for (std::size_t c = 0; c < 3; ++c) {
        image.channels[c].values[static_cast<std::size_t>(i)] = static_cast<float>(values[c] / samples);
      }
    }
  });
  return halves;
}

namespace {

/// Mean of the eight pixels around one: about as bright, but with noise of their own.
Vec3 neighbours_mean(const std::vector<Vec3>& pixels, int width, int height, int x, int y) {
  Vec3 sum;
  float count = 0;
  for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j) {
    for (int i = std::max(0, x - 1); i <= std::min(width - 1, x + 1); ++i) {
      if (i == x && j == y) continue;
      sum += pixels[static_cast<std::size_t>(j * width + i)];
      ++count;
    }
  }
  return count > 0 ? sum / count : pixels.front();
}

}  // namespace

Estimate relmse_without_noise(const Image& image, const Halves& reference) {
  const std::vector<Vec3> a = rgb_pixels(image), b = rgb_pixels(reference.first), c = rgb_pixels(reference.second);
  std::vector<Vec3> both(a.size());
  double mean = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    both[i] = (b[i] + c[i]) * 0.5f;
    mean += luminance(both[i]) / static_cast<double>(a.size());
  }
  double sum = 0, squares = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const auto i = static_cast<std::size_t>(y * image.width + x);
      const Vec3 scale = neighbours_mean(both, image.width, image.height, x, y);
      double pixel = 0;
      for (const auto k : {&Vec3::x, &Vec3::y, &Vec3::z}) {
        const double v = a[i].*k, near = scale.*k;
        pixel += (v - b[i].*k) * (v - c[i].*k) / (near * near + 0.01 * mean * mean) / 3;
      }
      sum += pixel;
      squares += pixel * pixel;
    }
  }
  const auto n = static_cast<double>(a.size());
  return {sum / n, std::sqrt(std::max(0.0, squares / n - sum / n * sum / n) / n)};
}

}  // namespace lightcuts::app::study
