#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "backend/backend.h"
#include "bench.h"
#include "bench_frame/goals.h"
#include "bench_frame/parts.h"
#include "bench_frame/sizes.h"
#include "interruption.h"
#include "lightcuts/scene.h"

namespace lightcuts::app::frame {

/// Measures what a frame's stages take, a row each.
///
/// Times are the device's where the backend measures them (CUDA events), else of the whole call. Each is the median of
/// many runs after a warm-up; what is timed is first compared with the sum over all lights.
class FrameBench {
 public:
  explicit FrameBench(const BenchRequest& request);
  BenchResult run();

 private:
  /// What is made anew for every run; else the maps of the run before serve.
  enum class Again { pixels, maps, everything };

  /// How often something is run.
  struct Effort {
    int runs;
    double longest_s;
  };

  // What is measured (stages.cpp, and files of their own).
  void measure_scene(const std::string& name, const std::string& spec);
  void measure_stages(std::uint64_t vpls);
  void measure_as_the_study(std::uint64_t vpls);
  void measure_curve(std::uint64_t vpls);
  void measure_with_visibility(std::uint64_t vpls);
  void measure_heap(std::uint32_t batch);
  void check_cut();
  void measure_making_of_maps();
  void measure_crossing(const std::string& stage, Again again);
  void measure_small_work();
  void measure_incoherent_rays();
  void measure_pull_push();

  // How (frame_bench.cpp).
  [[nodiscard]] bool stopped();
  [[nodiscard]] bool wants(const std::string& stage) { return !stopped() && parts_.wants_stage(stage); }
  [[nodiscard]] bool is_measured(const std::string& stage) const;
  [[nodiscard]] bool on_gpu() const { return backend_->has_own_memory(); }
  [[nodiscard]] static ShadeOptions options(Method method, Visibility visibility);

  /// From here on there are so many lights; they and their tree are made once something asks for them.
  void use(std::uint64_t vpls);
  void make_lights();
  static void trace(Backend& backend, std::uint64_t vpls, int bounces = kUnlimitedBounces);
  void time_vpls(const std::string& stage, int bounces);
  void time_tree();

  /// One picture: its time on the device [ms], or 0 where that is not measured.
  double picture_ms(const ShadeOptions& options, Again again, Statistics& statistics);
  void shade(const std::string& stage, const ShadeOptions& options, Again again = Again::pixels);

  /// The times [ms] that `run` returns, or where it returns 0 the clock's, after a warm-up; none where the user stops
  /// it.
  Repeats time(const Effort& effort, const std::function<double()>& run);
  [[nodiscard]] Effort effort() const { return {sizes_.runs, sizes_.longest_s}; }

  /// Appends a row and prints it with its goal and the words of `counted`; `more` goes into the JSON.
  void add_row(const std::string& stage, const Repeats& times, const Json& more, const std::string& counted);
  void print_goals();

  const BenchRequest& request_;
  const Parts parts_;
  const Sizes sizes_;
  std::string name_;  ///< of the scene
  Scene scene_;       ///< which the backend looks into
  std::unique_ptr<Backend> backend_;
  BenchResult result_;
  Camera camera_;
  std::uint64_t vpls_ = 0;
  bool has_lights_ = false;
};

}  // namespace lightcuts::app::frame
