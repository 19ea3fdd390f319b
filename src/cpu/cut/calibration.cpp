#include "cpu/cut/calibration.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <vector>

#include "cpu/cut/pixel_lights.h"
#include "cpu/ray_tracer.h"
#include "math/sample_stream.h"

namespace lightcuts {
namespace {

/// Levels that are drawn afresh. What is left below, where representatives stay those of the tree, is off by some
/// thousandth of what the whole node is: each level has twice the nodes, of half the intensity and less extent.
constexpr int kLevels = 6;

/// More than any cut that keeps a promise is off by: what limited cuts and absurd lights may ask for.
constexpr double kLargestGain = 2;

/// Root mean square of differences that most pictures at a bound of 2 % stay below: they are 1.2 % off the sum over all lights on
/// average, and their 99th percentile 4 %. (A difference has the cut's error and that of the light drawn afresh.) Where it
/// is a quarter more, a picture would be off by 1.5 % and 5 %.
constexpr double kWantedAtTwoPercent = 0.0225;
constexpr double kFarAbove = 1.25;
/// Errors grow by about this power of the bound (docs/results/cut.md).
constexpr double kErrorPower = 0.7;
/// A bound becomes finer by no more than this.
constexpr double kLeastFactor = 0.6;
constexpr std::uint64_t kTestsToTrust = 60;

/// A node of a cut on the way to a light below it.
struct Redrawn {
  const LightTree* tree;
  LightKind kind;
  std::uint32_t node;  ///< of the cut; then a descendant
  Vec3 intensity;      ///< of the node of the cut
  double number = 0;   ///< in [0, 1): what of the random number is left
};

/// The cuts of some pixels of a tile.
class CutsHeard final : public CutListener {
 public:
  struct Pixel {
    std::uint8_t at = 0;
    std::vector<Redrawn> inner;  ///< nodes of its cut that are not leaves
  };

  CutsHeard(const CutContext& context, const Tile& tile, int most, std::uint64_t seed, TestedTile& out)
      : context_(context), out_(out) {
    std::fill_n(slots_, kTilePixels, -1);
    for (int k = 0; k < most; ++k) {
      const double within = philox(static_cast<std::uint32_t>(k), 0, 0x70697865u, seed).unit_double(0);
      const int at = static_cast<int>((k + within) * kTilePixels / most);
      const SurfacePacket& packet = tile.packets[static_cast<std::size_t>(at / kPacketSize)];
      if ((packet.receivers.active >> (at % kPacketSize) & 1u) == 0) continue;
      slots_[at] = static_cast<int>(pixels.size());
      pixels.emplace_back().at = static_cast<std::uint8_t>(at);
    }
  }

  void chosen(LightKind kind, std::uint32_t index, const ReceiverGroup<float>&,
              std::span<const std::uint8_t> of) override {
    const LightTree& tree = tree_of(context_.trees, kind);
    const LightNode& node = tree.nodes[index];
    if (node.is_leaf()) return;
    for (const std::uint8_t at : of) {
      if (slots_[at] < 0) continue;
      pixels[static_cast<std::size_t>(slots_[at])].inner.push_back({&tree, kind, index, node.intensity});
    }
  }
  void hidden(LightKind, std::uint32_t, const ReceiverGroup<float>&, std::span<const std::uint8_t>) override {}
  void lit(std::uint8_t pixel, const Vec3T<double>& leaves) override { out_.leaves[pixel] = leaves; }

  std::vector<Pixel> pixels;

 private:
  const CutContext& context_;
  TestedTile& out_;
  int slots_[kTilePixels];
};

/// Moves every node to a descendant, each child chosen in proportion to its intensity. Level by level, so that the
/// memory for all of them is on its way at once.
void draw_descendants(std::vector<Redrawn>& nodes, std::uint32_t pixel, std::uint64_t seed) {
  for (std::size_t i = 0; i < nodes.size(); i += 4) {
    const Sample4 numbers = philox(static_cast<std::uint32_t>(i), pixel, 0x64726177u, seed);
    for (std::size_t k = 0; k < std::min<std::size_t>(4, nodes.size() - i); ++k) {
      nodes[i + k].number = numbers.unit_double(static_cast<int>(k));
    }
  }
  for (int level = 0; level < kLevels; ++level) {
    for (Redrawn& r : nodes) {
      const LightNode& node = r.tree->nodes[r.node];
      if (node.is_leaf()) continue;
      const double first = luminance(r.tree->nodes[node.first_child].intensity);
      const double second = luminance(r.tree->nodes[node.second_child()].intensity);
      const bool takes_first = first_represents(first, second, r.number);
      const double drawn = r.number * (first + second);
      if (takes_first) {
        r.node = node.first_child;
        if (first > 0) r.number = drawn / first;
      } else {
        r.node = node.second_child();
        r.number = (drawn - first) / second;
      }
      const LightNode& taken = r.tree->nodes[r.node];
      if (!taken.is_leaf()) {
        __builtin_prefetch(&r.tree->nodes[taken.first_child]);
        __builtin_prefetch(&r.tree->nodes[taken.second_child()]);
      }
    }
  }
}

/// Adds what arrives along rays of one origin, 16 at a time.
class RaySum {
 public:
  RaySum(const RayTracer* tracer, Vec3 origin) : tracer_(tracer), origin_(origin) {}

  void add(double value, const LightWay& way) {
    if (tracer_ == nullptr) {
      sum_ += value;
      return;
    }
    if (!(value > 0)) return;
    values_[count_] = value;
    rays_.set(count_++, origin_, way.direction, way.t_max);
    if (count_ == kPacketSize) trace();
  }
  double sum() {
    if (count_ > 0) trace();
    return sum_;
  }
  [[nodiscard]] std::uint64_t traced() const { return traced_; }

 private:
  void trace() {
    const std::uint32_t asked = (1u << count_) - 1;
    for (std::uint32_t open = asked & ~tracer_->occluded16(rays_, asked); open != 0; open &= open - 1) {
      sum_ += values_[std::countr_zero(open)];
    }
    traced_ += static_cast<std::uint64_t>(count_);
    count_ = 0;
  }

  const RayTracer* tracer_;
  Vec3 origin_;
  RayPacket16 rays_{};  // lanes that are not asked, too: Embree looks at all of them
  double values_[kPacketSize];
  double sum_ = 0;
  int count_ = 0;
  std::uint64_t traced_ = 0;
};

/// Luminance of what a pixel of a tile reflects, times pi.
double reflected(const Tile& tile, std::size_t pixel, const Vec3T<double>& light) {
  const PacketVec3& albedo = tile.packets[pixel / kPacketSize].albedo;
  const std::size_t lane = pixel % kPacketSize;
  const Vec3 w = reflected_weights({albedo.x[lane], albedo.y[lane], albedo.z[lane]});
  return w.x * light.x + w.y * light.y + w.z * light.z;
}

/// Lights a pixel's inner nodes again.
CutTests test_pixel(const CutContext& context, const RayTracer* tracer, const Tile& tile, const TestedTile& lit,
                    CutsHeard::Pixel& pixel, std::uint64_t seed) {
  const PixelLights lights(context, tile.packets[pixel.at / kPacketSize], pixel.at % kPacketSize);
  const double total = reflected(tile, pixel.at, lit.light.light[pixel.at]);
  const double inner = total - reflected(tile, pixel.at, lit.leaves[pixel.at]);

  draw_descendants(pixel.inner, pixel.at, seed);
  RaySum afresh(tracer, lights.position());
  for (const Redrawn& r : pixel.inner) {
    const LightWay way = lights.way_to(r.kind, r.tree->nodes[r.node].representative);
    afresh.add(double{dot(lights.weights(), r.intensity)} * way.unit.clamped, way);
  }

  CutTests test;
  const double difference = (afresh.sum() - inner) / total;
  test.rays = afresh.traced();
  test.pairs = pixel.inner.size();
  if (!std::isfinite(difference)) return test;
  test.difference = difference;
  test.difference_sq = difference * difference;
  test.inner = inner / total;
  test.count = 1;
  return test;
}

}  // namespace

void CutTests::add(const CutTests& other) {
  difference += other.difference;
  difference_sq += other.difference_sq;
  inner += other.inner;
  count += other.count;
  rays += other.rays;
  pairs += other.pairs;
}

double CutTests::needed(double standard_error) const {
  return count == 0 ? 0 : difference_sq / static_cast<double>(count) / (standard_error * standard_error);
}

double CutTests::suitable_error(double error, double promised) const {
  if (count < kTestsToTrust || !(difference_sq > 0)) return error;
  const double found = std::sqrt(difference_sq / static_cast<double>(count));
  const double wanted = kWantedAtTwoPercent * std::pow(promised / 0.02, kErrorPower);
  if (found < kFarAbove * wanted) return error;
  return error * std::max(std::pow(wanted / found, 1 / kErrorPower), kLeastFactor);
}

double CutTests::gain() const {
  const auto n = static_cast<double>(count);
  const double mean = count == 0 ? 0 : difference / n;
  if (!(inner > 0) || mean == 0) return 1;
  const double variance = difference_sq / n / n;
  const double certain = mean * mean / (mean * mean + variance);
  const double gain = 1 + certain * difference / inner;
  return std::isfinite(gain) ? std::clamp(gain, 1 / kLargestGain, kLargestGain) : 1;
}

bool TestedTile::take(const CutContext& context, const Tile& tile, TileLight& out) const {
  const double threshold = context.threshold(1), largest_gain = std::max(context.gain, 1.0);
  out = light;
  for (std::size_t i = 0; i < kTilePixels; ++i) {
    const Vec3T<double> inner = light.light[i] - leaves[i];
    if (!std::isfinite(luminance(inner))) continue;
    out.light[i] = leaves[i] + inner * context.gain;
    if (!(light.cut_bound[i] > 0)) continue;
    const double growth = reflected(tile, i, out.light[i]) / reflected(tile, i, light.light[i]);
    const double bound = light.cut_bound[i] * largest_gain / growth;
    if (!(bound <= threshold) && !light.cut_at_limit[i]) return false;
    out.cut_bound[i] = static_cast<float>(bound);
  }
  return true;
}

void test_cuts(const CutTools& tools, const RayTracer* tracer, const Tile& tile, int most, std::uint64_t seed,
               CutScratch& scratch, TestedTile& out) {
  out.x0 = tile.x0;
  out.y0 = tile.y0;
  CutsHeard heard(tools.context, tile, most, seed, out);
  CutTools listening = tools;
  listening.listener = &heard;
  cut_pixels(listening, tile.packets, scratch, out.light);
  for (CutsHeard::Pixel& pixel : heard.pixels) {
    out.tests.add(test_pixel(tools.context, tracer, tile, out, pixel, seed));
  }
}

}  // namespace lightcuts
