#include "cuda/heap_cut.h"

#include <algorithm>
#include <string>
#include <utility>

#include "cuda/executor.cuh"
#include "cuda/staged_light.cuh"
#include "cuda/tracer.cuh"
#include "kernels/cluster_bound.h"
#include "kernels/light.h"
#include "kernels/map_lookup.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

constexpr int kHeapThreads = 64;
/// Entries of the first heaps where no largest cut says how many are enough; later ones have so many times more.
constexpr std::uint32_t kFirstHeap = 1024, kHeapGrowth = 8;
/// Heaps take at most this, so that a million lights fit into half a gigabyte with them.
constexpr std::uint64_t kMostHeapBytes = std::uint64_t{192} << 20;
/// Once the total has shrunk to this share of what was once in it, rounding of subtractions may matter: sum again.
constexpr double kResumShare = 1e-6;

/// A node in a pixel's cut. 16 bytes.
struct alignas(16) HeapEntry {
  float bound;
  std::uint32_t word;  ///< node, the kind of light in the two highest bits
  float clamped, unclamped;

  static constexpr int kKindShift = 30;
  [[nodiscard]] __device__ int kind() const { return static_cast<int>(word >> kKindShift); }
  [[nodiscard]] __device__ std::uint32_t node() const { return word & ((1u << kKindShift) - 1); }
};

/// What a light of unit intensity gives to a pixel.
struct Unit {
  float clamped = 0, unclamped = 0;
};

struct HeapJob {
  DeviceTracer tracer;
  PixelView pixels;
  CutJob job;
  SumView sums;
  CutView cuts;
  HeapEntry* heaps;  ///< entry k of thread t at k * batch + t
  std::uint32_t batch, capacity;
  const std::uint32_t* slots;  ///< of the pixels, null: all in order
  HeapVisibility visibility;
  std::uint32_t* too_small;  ///< a flag a pixel: its heap did not do
};

enum class HeapOutcome : std::uint8_t { lit, too_small, missed };

template <HeapSight sight>
class PixelHeap {
  static constexpr bool rays = sight == HeapSight::rays;

 public:
  __device__ PixelHeap(const HeapJob& job, std::uint32_t thread, std::uint32_t slot)
      : job_(job), thread_(thread), slot_(slot) {
    const PixelView& p = job.pixels;
    receiver_ = {p.position[slot], p.ns[slot], p.ng[slot]};
    const Vec3 albedo = p.albedo[slot];
    weights_ = {0.2126f * albedo.x, 0.7152f * albedo.y, 0.0722f * albedo.z};
    min_distance_sq_ = job.job.min_distance * job.job.min_distance;
  }

  /// Nothing is written but of a pixel that is lit.
  __device__ HeapOutcome run() {
    if (receiver_.ns == Vec3{}) return finish_empty();
    for (int kind = 0; kind < kKinds; ++kind) {
      const TreeView& tree = job_.job.trees.kind[kind];
      if (tree.leaf_count > 0 && !add(kind, 0, evaluate(kind, tree.nodes[0].representative))) {
        return HeapOutcome::too_small;
      }
    }
    while (!done()) {
      if (!refine()) return HeapOutcome::too_small;
    }
    if (missed_) return HeapOutcome::missed;
    finish();
    return HeapOutcome::lit;
  }

 private:
  [[nodiscard]] __device__ HeapEntry& entry(std::uint32_t k) const {
    return job_.heaps[std::size_t{k} * job_.batch + thread_];
  }
  [[nodiscard]] __device__ const LightNode& node(int kind, std::uint32_t index) const {
    return job_.job.trees.kind[kind].nodes[index];
  }

  __device__ Unit evaluate(int kind, std::uint32_t light) {
    ++pairs_;
    const LightArrays& lights = job_.job.lights;
    Unit unit;
    Ray ray{receiver_.position, 0, {}, kShadowRayEnd};
    if (kind == vpl_kind) {
      const Vpl vpl = lights.vpls[light];
      const VplFactor<float> f = vpl_factor(receiver_, vpl.position, vpl.axis, min_distance_sq_);
      unit = {f.clamped, f.unclamped};
      if (rays) ray.direction = offset_point(vpl.position, vpl.axis) - receiver_.position;
    } else if (kind == point_kind) {
      const StagedLight p = stage_light<point_kind>(lights, light, {});
      const float f = point_factor(receiver_, Spot<float>{p.position, p.axis, p.cos_outer, p.inverse_range});
      unit = {f, f};
      ray.direction = p.position - receiver_.position;
    } else {
      const Vec3 direction = lights.directionals[light].direction;
      const float f = directional_factor(receiver_, direction);
      unit = {f, f};
      ray.direction = -direction;
      ray.t_max = kInfinity;
    }
    if (rays && unit.clamped > 0) {
      ++rays_;
      if (job_.tracer.occluded(ray)) return {};
    }
    if (sight == HeapSight::maps && unit.clamped > 0) {
      const float share = share_of(kind, light);
      return {unit.clamped * share, unit.unclamped * share};
    }
    return unit;
  }

  /// By the light's map; a missing one is marked as wanted, and all of the light arrives.
  __device__ float share_of(int kind, std::uint32_t light) {
    const MapSetView& maps = job_.visibility.maps;
    const std::uint32_t slot = (kind == vpl_kind     ? maps.vpl_slots
                                : kind == point_kind ? maps.point_slots
                                                     : maps.directional_slots)[light];
    if (slot == kNone) {
      const std::uint32_t row = job_.visibility.table.row(kind, light);
      if (row != kNone) return job_.visibility.table.share(row, slot_ % kTilePixels);
      job_.visibility.wanted.mark(kind, light);
      missed_ = true;
      return 1;
    }
    const Vec3 at = receiver_.position, ng = receiver_.ng;
    if (kind == vpl_kind) return vpl_share(maps, light, at, ng);
    if (kind == point_kind) return point_share(maps, light, job_.job.lights.points[light].cos_outer, at, ng);
    return directional_share(maps, light, at, ng);
  }

  __device__ float bound_of(int kind, const LightNode& n) const {
    const LitPoint<float> point{receiver_.position, receiver_.ns};
    const DirectionCone cone{n.axis, n.cos_half_angle};
    const float geometric = kind == vpl_kind     ? vpl_bound(point, n.box, cone, min_distance_sq_)
                            : kind == point_kind ? point_bound(point, n.box, cone, kPointGuardSq)
                                                 : directional_bound(point.normal, n.box);
    const float bound = dot(weights_, n.intensity) * geometric;
    return bound <= 3.4028234e38f ? bound : kInfinity;  // sums of lights of absurd strength: split them
  }

  __device__ double luminance_of(const LightNode& n, float clamped) const {
    const double share =
        (static_cast<double>(weights_.x) * n.intensity.x + static_cast<double>(weights_.y) * n.intensity.y +
         static_cast<double>(weights_.z) * n.intensity.z) *
        clamped;
    return share < 1e300 ? share : 0;
  }

  __device__ void take(const LightNode& n, Unit unit) {
    if (unit.clamped > 0) {
      light_ += Vec3T<double>{n.intensity.x, n.intensity.y, n.intensity.z} * static_cast<double>(unit.clamped);
    }
    lost_ += static_cast<double>(luminance(n.intensity)) * (static_cast<double>(unit.unclamped) - unit.clamped);
    if (job_.cuts.used[taken_kind_] != nullptr) {
      std::uint32_t* const word = &job_.cuts.used[taken_kind_][n.representative / 32];
      const std::uint32_t bit = 1u << n.representative % 32;
      if ((*word & bit) == 0) atomicOr(word, bit);
    }
  }

  __device__ bool add(int kind, std::uint32_t index, Unit unit) {
    const LightNode& n = node(kind, index);
    const double share = luminance_of(n, unit.clamped);
    if (n.is_leaf()) {
      taken_kind_ = kind;
      take(n, unit);
      ++leaves_;
      leaf_total_ += share;
      return true;
    }
    if (size_ == job_.capacity) return false;
    heap_total_ += share;
    peak_ = max_of(peak_, heap_total_);
    push({bound_of(kind, n), index | static_cast<std::uint32_t>(kind) << HeapEntry::kKindShift, unit.clamped,
          unit.unclamped});
    return true;
  }

  __device__ void push(HeapEntry e) {
    std::uint32_t k = size_++;
    while (k > 0) {
      const std::uint32_t parent = (k - 1) / 2;
      const HeapEntry above = entry(parent);
      if (above.bound >= e.bound) break;
      entry(k) = above;
      k = parent;
    }
    entry(k) = e;
  }

  __device__ HeapEntry pop() {
    const HeapEntry top = entry(0), last = entry(--size_);
    std::uint32_t k = 0;
    while (2 * k + 1 < size_) {
      std::uint32_t child = 2 * k + 1;
      HeapEntry below = entry(child);
      if (child + 1 < size_) {
        const HeapEntry other = entry(child + 1);
        if (other.bound > below.bound) {
          below = other;
          ++child;
        }
      }
      if (last.bound >= below.bound) break;
      entry(k) = below;
      k = child;
    }
    if (size_ > 0) entry(k) = last;
    return top;
  }

  __device__ bool refine() {
    const HeapEntry top = pop();
    const int kind = top.kind();
    const LightNode& n = node(kind, top.node());
    heap_total_ -= luminance_of(n, top.clamped);
    const std::uint32_t first = n.first_child;
    if (!add(kind, first, {top.clamped, top.unclamped})) return false;
    if (!add(kind, first + 1, evaluate(kind, node(kind, first + 1).representative))) return false;
    if (heap_total_ < kResumShare * peak_) sum_again();
    return true;
  }

  __device__ void sum_again() {
    heap_total_ = 0;
    for (std::uint32_t k = 0; k < size_; ++k) {
      const HeapEntry e = entry(k);
      heap_total_ += luminance_of(node(e.kind(), e.node()), e.clamped);
    }
    peak_ = heap_total_;
  }

  [[nodiscard]] __device__ double threshold(double total) const {
    return static_cast<double>(job_.job.error) * (1 - kThresholdSlack) * total;
  }

  __device__ bool done() const {
    if (size_ == 0) return true;
    if (job_.job.max_cut > 0 && size_ + leaves_ >= job_.job.max_cut) return true;
    return entry(0).bound <= threshold(heap_total_ + leaf_total_);
  }

  __device__ HeapOutcome finish_empty() {
    job_.cuts.size[slot_] = 0;
    job_.cuts.bound[slot_] = 0;
    job_.cuts.at_limit[slot_] = 0;
    return HeapOutcome::lit;
  }

  __device__ void finish() {
    const double largest = size_ > 0 ? static_cast<double>(entry(0).bound) : 0;
    for (std::uint32_t k = 0; k < size_; ++k) {
      const HeapEntry e = entry(k);
      taken_kind_ = e.kind();
      take(node(e.kind(), e.node()), {e.clamped, e.unclamped});
    }
    const double total = weights_.x * light_.x + weights_.y * light_.y + weights_.z * light_.z;
    job_.sums.light[slot_] += light_;
    job_.sums.lost[slot_] += lost_;
    job_.sums.rays[slot_] += rays_;
    job_.cuts.size[slot_] = size_ + leaves_;
    job_.cuts.bound[slot_] = !(largest > 0)           ? 0.0f
                             : largest < 3e38 * total ? static_cast<float>(largest / total)
                                                      : 3e38f;
    job_.cuts.at_limit[slot_] = largest > threshold(total) ? 1 : 0;
    if (job_.cuts.counts != nullptr) atomicAdd(&job_.cuts.counts->pairs, static_cast<unsigned long long>(pairs_));
  }

  const HeapJob& job_;
  std::uint32_t thread_, slot_;
  Receiver<float> receiver_;
  Vec3 weights_;
  float min_distance_sq_;
  std::uint32_t size_ = 0, leaves_ = 0, rays_ = 0, pairs_ = 0;
  int taken_kind_ = 0;
  bool missed_ = false;  ///< some light's map
  double heap_total_ = 0, leaf_total_ = 0, peak_ = 0, lost_ = 0;
  Vec3T<double> light_{};
};

template <HeapSight sight>
__global__ void __launch_bounds__(kHeapThreads) heap_kernel(HeapJob job, std::uint32_t first, std::uint32_t last) {
  const std::uint32_t thread = blockIdx.x * kHeapThreads + threadIdx.x, place = first + thread;
  if (place >= last) return;
  const std::uint32_t slot = job.slots != nullptr ? job.slots[place] : place;
  const HeapOutcome outcome = PixelHeap<sight>(job, thread, slot).run();
  job.too_small[place] = outcome == HeapOutcome::too_small ? 1 : 0;
  if (outcome == HeapOutcome::missed) job.visibility.missed.add(slot);
}

struct GatherSlots {
  const std::uint32_t* slots;
  const std::uint32_t* flags;
  const std::uint32_t* places;
  std::uint32_t* out;
  __device__ void operator()(std::uint32_t i) const {
    if (flags[i] != 0) out[places[i]] = slots != nullptr ? slots[i] : i;
  }
};

/// Pixels at a time, whole blocks.
std::uint32_t plan_batch(const Device& device, std::uint32_t wanted, std::uint32_t capacity) {
  const std::uint64_t each = std::uint64_t{capacity} * sizeof(HeapEntry);
  const std::uint64_t left = device.limit() - std::min(device.limit(), device.used());
  const std::uint64_t bytes = std::min(kMostHeapBytes, left / 4 * 3);
  const std::uint64_t fitting = std::max(bytes, std::min(left / 4 * 3, each * kHeapThreads)) / each;
  const std::uint64_t batch = std::min<std::uint64_t>(wanted, fitting) / kHeapThreads * kHeapThreads;
  if (batch == 0) {
    throw Error(Code::out_of_memory, "Heaps of " + std::to_string(capacity) +
                                         " nodes for 64 pixels do not fit into the GPU's memory limit. Give a larger "
                                         "--memory, a --max-cut, or use --cut packet.");
  }
  return static_cast<std::uint32_t>(batch);
}

}  // namespace

bool cut_by_heaps(Device& device, const TracedScene& traced, const PixelView& pixels, const CutJob& job,
                  const HeapVisibility& visibility, PixelList list, std::uint32_t batch, const SumView& sums,
                  const CutView& cuts, const std::function<bool(double done)>& go_on) {
  std::uint64_t lights = 0;
  for (const TreeView& tree : job.trees.kind) {
    lights += tree.leaf_count;
    if (tree.leaf_count > 1u << (HeapEntry::kKindShift - 1)) {
      throw Error(Code::invalid_argument, "--cut heap numbers at most 536 million lights of a kind; use --cut packet.");
    }
  }
  CudaExecutor exec(device);
  HeapJob heaps{{traced.scene, traced.bvh}, pixels, job, sums, cuts, nullptr, 0, 0, nullptr, visibility, nullptr};
  const auto most = static_cast<std::uint32_t>(std::min<std::uint64_t>(lights + 3, 0xffffffffu));
  heaps.capacity = std::min(most, job.max_cut > 0 ? job.max_cut + 3 : kFirstHeap);
  std::uint32_t count = list.count;
  heaps.slots = list.slots;
  DeviceBuffer<std::uint32_t> slots;
  while (count > 0) {
    heaps.batch = plan_batch(device, std::max<std::uint32_t>(batch, kHeapThreads), heaps.capacity);
    DeviceBuffer<HeapEntry> space(device, std::size_t{heaps.batch} * heaps.capacity);
    DeviceBuffer<std::uint32_t> too_small(device, count);
    heaps.heaps = space.data();
    heaps.too_small = too_small.data();
    for (std::uint32_t first = 0; first < count; first += heaps.batch) {
      const std::uint32_t last = std::min(count, first + heaps.batch);
      const std::uint32_t blocks = (last - first + kHeapThreads - 1) / kHeapThreads;
      const auto kernel = visibility.sight == HeapSight::rays   ? heap_kernel<HeapSight::rays>
                          : visibility.sight == HeapSight::maps ? heap_kernel<HeapSight::maps>
                                                                : heap_kernel<HeapSight::all>;
      kernel<<<blocks, kHeapThreads, 0, device.stream()>>>(heaps, first, last);
      check(cudaGetLastError(), "cutting light trees by heaps");
      if (go_on && !go_on(static_cast<double>(last) / count)) return false;
    }
    if (heaps.capacity == most || job.max_cut > 0) break;
    DeviceBuffer<std::uint32_t> places(device, count);
    const std::uint32_t left = exec.exclusive_scan(too_small.data(), places.data(), count);
    DeviceBuffer<std::uint32_t> next(device, left);
    if (left > 0) exec.for_each(count, GatherSlots{heaps.slots, too_small.data(), places.data(), next.data()});
    slots = std::move(next);
    heaps.slots = slots.data();
    count = left;
    heaps.capacity =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(most, std::uint64_t{heaps.capacity} * kHeapGrowth));
  }
  return true;
}

}  // namespace lightcuts::cuda
