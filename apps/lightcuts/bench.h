#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lightcuts/render.h"

namespace lightcuts {
class Backend;
}

namespace lightcuts::app {

/// How much a benchmark does.
enum class BenchScale {
  smoke,   ///< seconds: only shows that everything runs; what CI runs beside its tests
  quick,   ///< two minutes on two cores
  small,   ///< some ten minutes on two cores: pictures smaller than asked for, said so
  medium,  ///< some seven minutes on 16 cores; likewise
  full     ///< the sizes of the published tables and beyond
};

/// What `lightcuts bench` was asked for.
struct BenchRequest {
  std::vector<std::string> names;
  bool list = false;
  BackendKind backend = BackendKind::automatic;
  int device = 0;
  int threads = 0;  ///< 0: all
  BenchScale scale = BenchScale::full;
  std::filesystem::path json;      ///< empty: none
  std::filesystem::path report;    ///< folder; empty: none
  std::filesystem::path scenes;    ///< folder with rooms (NAME/scene.gltf); empty: ../shared/scenes/rooms if there
  std::vector<std::string> parts;  ///< of `study`: which; empty: all
  double budget_s = 0;             ///< longest time of one measurement; 0: the scale's
  bool page_only = false;          ///< of `study`: draws the page of what `report` holds, measures nothing
  bool quiet = false;
};

/// What a benchmark found.
struct BenchResult {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  bool correct = true;   ///< every result that was checked before it was timed agreed with its reference
  bool complete = true;  ///< false where it was interrupted
};

/// A benchmark: checks its results, times them, prints a table on stdout and returns its figures.
struct Benchmark {
  const char* name;
  const char* summary;
  BenchResult (*run)(const BenchRequest& request);
};

/// All of them; a new one adds its line in bench_list.cpp.
const std::vector<Benchmark>& benchmarks();

/// The backend that was asked for; `automatic` is CUDA where a device answers, else the CPU.
/// Throws Error{not_built, no_device}.
std::unique_ptr<Backend> make_bench_backend(const BenchRequest& request);

/// What a reader must know to compare figures: version, commit, date, processor, cores, load, memory, device.
nlohmann::ordered_json machine_json(const std::string& device);

/// Middle one and spread of repeated measurements of the same thing.
struct Repeats {
  double median = 0, low = 0, high = 0;
  int count = 0;
};
Repeats summarise(std::vector<double> values);

// The benchmarks, a file or a folder each.
BenchResult run_study(const BenchRequest& request);
BenchResult run_frame(const BenchRequest& request);

}  // namespace lightcuts::app
