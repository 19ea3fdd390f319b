// Light trees measured on a synthetic room: how long they take to build, how large cuts through them are, how tight their
// bounds are. `tree_bench --help` lists the questions; docs/results/tree.md and bounds.md hold answers.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <exception>
#include <string>
#include <vector>

#include "cpu/tree/agglomerative.h"
#include "cpu/tree/assemble_tree.h"
#include "cpu/tree/build_light_trees.h"
#include "cpu/tree/leaf_clusters.h"
#include "cpu/tree/ploc.h"
#include "kernels/group_bound.h"
#include "math/frame.h"
#include "oracle/classic_bound.h"
#include "oracle/cut_oracle.h"
#include "oracle/synthetic_room.h"

namespace lightcuts {
namespace {

using oracle::CutPoint;

/// Clamp of the singularity [m]: a hundredth of the room's diagonal.
constexpr double kClamp = 0.15;
constexpr const char* kMetricNames[] = {"walter", "distance", "distance-color", "distance-direction",
                                        "distance-color-direction"};

struct Options {
  std::vector<std::size_t> lights{10000};
  int points = 200;
  int seeds = 3;
  double error = 0.02;
};

struct RoomCase {
  std::vector<Vpl> lights;
  std::vector<CutPoint> points;
};

RoomCase make_case(std::size_t light_count, int point_count, std::uint64_t seed) {
  oracle::SyntheticRoom room(seed);
  RoomCase made{room.lights(light_count), {}};
  for (int i = 0; i < point_count; ++i) {
    const oracle::RoomPoint point = room.receiver();
    made.points.push_back({point.position, point.normal, point.albedo, kClamp});
  }
  return made;
}

struct CutMeans {
  double size = 0, error = 0;
};

template <class Bound>
CutMeans measure_cuts(const RoomCase& room, const LightTree& tree, double error, const Bound& bound) {
  std::vector<CutMeans> all(room.points.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    const oracle::CutResult cut = oracle::heap_cut(tree, room.lights, room.points[i], error, bound);
    const double exact = oracle::brute_force(room.lights, room.points[i]);
    all[i] = {static_cast<double>(cut.nodes.size()), exact > 0 ? std::abs(cut.total - exact) / exact : 0};
  });
  CutMeans mean;
  for (const CutMeans& one : all) {
    mean.size += one.size / static_cast<double>(all.size());
    mean.error += one.error / static_cast<double>(all.size());
  }
  return mean;
}

/// Means over seeds of the room, for a builder that makes merges of leaf clusters.
template <class Build>
void print_cuts(const std::string& name, std::size_t light_count, Metric metric, const Options& options,
                const Build& build) {
  CutMeans mean;
  for (int seed = 1; seed <= options.seeds; ++seed) {
    const RoomCase room = make_case(light_count, options.points, static_cast<std::uint64_t>(seed));
    const LeafClusters leaves = leaf_clusters(room.lights, metric, oracle::SyntheticRoom::diagonal());
    const LightTree tree = assemble_tree(build(leaves), leaves.clusters, static_cast<std::uint64_t>(seed));
    const CutMeans one = measure_cuts(room, tree, options.error, oracle::node_bound);
    mean.size += one.size / options.seeds;
    mean.error += one.error / options.seeds;
  }
  fmt::print("{:8} {:26} {:24} {:8.1f} {:8.2f} %\n", light_count, name, kMetricNames[static_cast<int>(metric)],
             mean.size, 100 * mean.error);
  std::fflush(stdout);
}

void metrics(const Options& options) {
  for (const std::size_t n : options.lights) {
    for (int m = 0; m < 5; ++m) {
      print_cuts("greedy", n, static_cast<Metric>(m), options,
                 [](const LeafClusters& l) { return build_agglomerative(l); });
    }
  }
}

void builders(const Options& options) {
  for (const std::size_t n : options.lights) {
    print_cuts("greedy", n, Metric::walter, options, [](const LeafClusters& l) { return build_agglomerative(l); });
    const PlocOptions mixed{.radius = 24, .greedy_below = 32768, .layout = {}};
    print_cuts("greedy above 32768", n, Metric::walter, options,
               [&](const LeafClusters& l) { return build_ploc(l, mixed); });
    print_cuts("ploc", n, Metric::walter, options, [](const LeafClusters& l) { return build_ploc(l); });
    print_cuts("morton", n, Metric::walter, options, [](const LeafClusters& l) { return build_morton(l); });
  }
}

void ploc(const Options& options) {
  for (const std::size_t n : options.lights) {
    for (const std::uint32_t radius : {2u, 4u, 8u, 16u, 31u}) {
      print_cuts(fmt::format("radius {}", radius), n, Metric::walter, options, [&](const LeafClusters& l) {
        return build_ploc(l, {.radius = radius, .greedy_below = 256, .layout = {}});
      });
    }
    for (const std::uint32_t below : {1u, 2048u, 16384u}) {
      print_cuts(fmt::format("greedy below {}", below), n, Metric::walter, options, [&](const LeafClusters& l) {
        return build_ploc(l, {.radius = 8, .greedy_below = below, .layout = {}});
      });
    }
    for (const LightKeyLayout key :
         {LightKeyLayout{21, 0, 0}, {16, 5, 0}, {16, 5, 1}, {16, 5, 3}, {16, 2, 0}, {16, 1, 0}}) {
      const std::string name = fmt::format("key {} {} {}", key.position_bits, key.direction_bits, key.direction_level);
      print_cuts(name + " ploc", n, Metric::walter, options, [&](const LeafClusters& l) {
        return build_ploc(l, {.radius = 8, .greedy_below = 256, .layout = key});
      });
      print_cuts(name + " morton", n, Metric::walter, options,
                 [&](const LeafClusters& l) { return build_morton(l, key); });
    }
  }
}

void build_times(const Options& options) {
  fmt::print("   lights builder        wall [s]  cpu [s]   nodes     depth\n");
  for (const std::size_t n : options.lights) {
    Lights lights;
    lights.vpls = oracle::SyntheticRoom(1).lights(n);
    for (const auto& [builder, name] :
         {std::pair{TreeBuilder::agglomerative, "agglomerative"}, std::pair{TreeBuilder::ploc, "ploc"},
          std::pair{TreeBuilder::morton, "morton"}}) {
      std::vector<double> walls, cpus;
      LightTrees trees;
      for (int run = 0; run < options.seeds; ++run) {
        const auto start = std::chrono::steady_clock::now();
        const std::clock_t cpu = std::clock();
        trees = build_light_trees(lights, oracle::SyntheticRoom::diagonal(), {builder, Metric::walter, 1});
        cpus.push_back(static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC);
        walls.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
      }
      std::sort(walls.begin(), walls.end());
      std::sort(cpus.begin(), cpus.end());
      fmt::print("{:9} {:14} {:8.3f} {:8.3f} {:9} {:6}\n", n, name, walls[walls.size() / 2], cpus[cpus.size() / 2],
                 trees.vpls.nodes.size(), trees.vpls.depth);
    }
  }
}

/// True maximum of the geometric term over the lights below a node: the tightest bound there is.
double true_maximum(const LightTree& tree, const std::vector<Vpl>& lights, const CutPoint& point, std::uint32_t node) {
  double largest = 0;
  std::vector<std::uint32_t> pending{node};
  while (!pending.empty()) {
    const LightNode& n = tree.nodes[pending.back()];
    pending.pop_back();
    if (n.is_leaf()) {
      const Vpl& light = lights[n.representative];
      largest = std::max(largest, oracle::vpl_term(point.position, point.normal, light.position, light.axis, kClamp));
    } else {
      pending.push_back(n.first_child);
      pending.push_back(n.second_child());
    }
  }
  return largest;
}

void print_quantiles(const char* name, std::vector<double> ratios) {
  std::sort(ratios.begin(), ratios.end());
  fmt::print("{:10}", name);
  for (const double q : {0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99})
    fmt::print(" {:9.3f}", ratios[static_cast<std::size_t>(q * static_cast<double>(ratios.size() - 1))]);
  fmt::print("  of {} nodes\n", ratios.size());
}

/// Sixteen points of a square of the plane through a point.
std::vector<CutPoint> square_around(const CutPoint& middle, float side) {
  const Frame frame = make_frame(middle.normal);
  std::vector<CutPoint> square(16, middle);
  for (int i = 0; i < 16; ++i) {
    const int column = i % 4, row = i / 4;
    const float s = static_cast<float>(column) / 3 - 0.5f, t = static_cast<float>(row) / 3 - 0.5f;
    square[static_cast<std::size_t>(i)].position += frame.x * (side * s) + frame.y * (side * t);
  }
  return square;
}

ReceiverGroup<double> group_of(const std::vector<CutPoint>& points) {
  Box box;
  for (const CutPoint& point : points) box = extend(box, point.position);
  const Vec3 axis = points[0].normal;
  float gain_lo = kInfinity, gain_hi = kInfinity;
  for (const CutPoint& point : points) {
    gain_lo = std::min(gain_lo, gap_to_end(-axis, box, point.position));
    gain_hi = std::min(gain_hi, gap_to_end(axis, box, point.position));
  }
  return receiver_group<double>(box, axis, 1, gain_lo, gain_hi);
}

/// The same for groups of points, over the nodes of their middle's cuts.
void group_bounds(const RoomCase& room, const LightTree& tree, double error) {
  for (const float share : {0.0f, 0.005f, 0.02f, 0.05f}) {
    std::vector<double> ratios;
    for (const CutPoint& middle : room.points) {
      const std::vector<CutPoint> square = square_around(middle, share * oracle::SyntheticRoom::diagonal());
      const ReceiverGroup<double> group = group_of(square);
      for (const std::uint32_t index : oracle::heap_cut(tree, room.lights, middle, error).nodes) {
        const LightNode& node = tree.nodes[index];
        if (node.is_leaf()) continue;
        double largest = 0;
        for (const CutPoint& point : square) largest = std::max(largest, true_maximum(tree, room.lights, point, index));
        if (!(largest > 0)) continue;
        const auto wide = [](Vec3 v) { return Vec3T<double>{v.x, v.y, v.z}; };
        const ClusterBounds<double> lights{wide(node.box.lo), wide(node.box.hi), wide(node.axis), node.cos_half_angle};
        ratios.push_back(group_vpl_bound(group, lights, middle.clamp * middle.clamp) / largest);
      }
    }
    print_quantiles(fmt::format("groups {:g} %", 100 * share).c_str(), ratios);
  }
}

/// Bound over true maximum of the inner nodes of cuts, and what cuts would be with other bounds.
void bounds(const Options& options) {
  for (const std::size_t n : options.lights) {
    const RoomCase room = make_case(n, options.points, 1);
    const LeafClusters leaves = leaf_clusters(room.lights, Metric::walter, oracle::SyntheticRoom::diagonal());
    const LightTree tree = assemble_tree(build_ploc(leaves), leaves.clusters, 1);
    const auto ideal = [&](const CutPoint& point, const LightNode& node) {
      return true_maximum(tree, room.lights, point, static_cast<std::uint32_t>(&node - tree.nodes.data()));
    };
    std::vector<double> ours, classic;
    for (const CutPoint& point : room.points) {
      for (const std::uint32_t index : oracle::heap_cut(tree, room.lights, point, options.error).nodes) {
        const LightNode& node = tree.nodes[index];
        const double largest = node.is_leaf() ? 0 : ideal(point, node);
        if (!(largest > 0)) continue;
        ours.push_back(oracle::node_bound(point, node) / largest);
        classic.push_back(oracle::classic_bound(point, node) / largest);
      }
    }
    fmt::print("{} lights; bound / true maximum at quantiles 0, 5, 25, 50, 75, 95, 99 %\n", n);
    print_quantiles("ours", ours);
    print_quantiles("classic", classic);
    group_bounds(room, tree, options.error);
    fmt::print("mean cut: classic {:.1f}, ours {:.1f}, ideal {:.1f}\n",
               measure_cuts(room, tree, options.error, oracle::classic_bound).size,
               measure_cuts(room, tree, options.error, oracle::node_bound).size,
               measure_cuts(room, tree, options.error, ideal).size);
  }
}

int run(int argc, char** argv) {
  CLI::App app{"Measures light trees on a synthetic room."};
  app.require_subcommand(1);
  app.fallthrough();
  Options options;
  app.add_option("--lights", options.lights, "numbers of VPLs");
  app.add_option("--points", options.points, "points that are lit");
  app.add_option("--seeds", options.seeds, "rooms (or runs, for times) to average over");
  app.add_option("--error", options.error, "bound on each node relative to the total");
  app.add_subcommand("metrics", "mean cut of each metric")->callback([&] { metrics(options); });
  app.add_subcommand("builders", "mean cut of each builder")->callback([&] { builders(options); });
  app.add_subcommand("ploc", "mean cut by window and key")->callback([&] { ploc(options); });
  app.add_subcommand("times", "time to build")->callback([&] { build_times(options); });
  app.add_subcommand("bounds", "tightness of the bounds")->callback([&] { bounds(options); });
  CLI11_PARSE(app, argc, argv);
  return 0;
}

}  // namespace
}  // namespace lightcuts

int main(int argc, char** argv) {
  try {
    return lightcuts::run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
