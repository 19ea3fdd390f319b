#pragma once

#include "cuda/light_tree.h"
#include "cuda/picture_kernels.h"
#include "cuda/sum_kernels.h"
#include "kernels/cut_criterion.h"
#include "kernels/occluder.h"

namespace lightcuts::cuda {

/// What counts of a picture's cuts are added to; whole numbers, so that the order of adding does not matter.
struct CutCounts {
  unsigned long long pairs;   ///< pixel-light pairs evaluated
  unsigned long long visits;  ///< nodes tested
  unsigned long long walks;   ///< from the roots down, of a group of pixels
  unsigned long long groups;  ///< of pixels that walk together
};

/// A node of the cut of some pixels of a tile.
struct ListedNode {
  std::uint32_t tile, walk;  ///< of a pixel's walks the last one counts
  std::uint32_t lanes;       ///< bit i: the walk is pixel i's
  std::uint32_t kind, node;
};
/// What every pixel chose, for tests.
struct CutListing {
  ListedNode* nodes = nullptr;
  std::uint32_t* count = nullptr;
  std::uint32_t capacity = 0;
  bool own_cuts = false;  ///< as where looking at a light is dear
};

/// Groups that a tile's pixels form at most. Group k of tile t has the number t * kTileGroups + k, whether it exists or
/// not.
inline constexpr std::uint32_t kTileGroups = 4;

/// Groups of pixels that are to be lit by a crew, in no order.
struct GroupQueue {
  struct Entry {
    std::uint32_t group;
    bool missed;  ///< it misses maps, of which the list knows
  };
  Entry* entries = nullptr;  ///< with room for all
  std::uint32_t* count = nullptr;
#if defined(__CUDACC__)
  __device__ void add(const Entry& entry) const { entries[atomicAdd(count, 1u)] = entry; }
#endif
};

/// Who lights a group of pixels.
enum class LitBy : std::uint8_t { warp, crew, large_crew };

/// What a cut leaves of each pixel, beside SumView.
struct CutView {
  std::uint32_t* size;            ///< nodes; 0 where nothing is seen
  float* bound;                   ///< largest bound of a node relative to the pixel's total
  std::uint8_t* at_limit;         ///< the largest cut came before the promised bound
  CutCounts* counts;              ///< null: not wanted
  std::uint32_t* used[kKinds];    ///< a bit a light that represents a node of some cut; null: not wanted
  std::uint32_t* cost = nullptr;  ///< of each group: what its dearest run took, in node tests; null: not wanted
  LitBy* lit_by = nullptr;        ///< of each group, as far as earlier rounds found out; null: there are none
  CutListing listing = {};        ///< only without shadow rays
  GroupQueue left = {};           ///< for what is left to a crew, or a larger one; without memory: nothing is
};

/// Receives the numbers of what has to be lit again, for want of shadow maps; in no order.
struct MissedList {
  std::uint32_t* units = nullptr;
  std::uint32_t* count = nullptr;
#if defined(__CUDACC__)
  __device__ void add(std::uint32_t unit) const { units[atomicAdd(count, 1u)] = unit; }
#endif
};

/// Groups to light, by their numbers.
struct GroupList {
  const std::uint32_t* groups = nullptr;
  std::uint32_t count = 0;
  MissedList missed = {};
};

/// Node tests, a look at a light counting for some of them, after which what lights a group of pixels changes its ways.
/// Where hardly any light arrives, cuts have very many nodes.
struct WorkLimits {
  std::uint32_t most;   ///< of a warp, after which the group is left to a crew of blocks
  std::uint32_t doubt;  ///< of a warp's first walk, after which it begins again with a higher threshold
  std::uint32_t crew;   ///< of each block of a crew, after which the group is left to a larger one
};
/// By visibility: none; shadow rays; shadow maps; maps of few lights; to ask for maps only. By measurement
/// (docs/results/gpu.md).
inline constexpr WorkLimits kWork{16384, 4096, 65536}, kWorkByRays{8192, 2048, 32768}, kWorkByMaps{49152, 8192, 196608},
    kWorkByFewMaps{32768, 8192, 131072}, kWorkToAsk{8192, 8192, 32768};

/// What cuts work on.
struct CutJob {
  TreeViews trees;
  LightArrays lights;
  float min_distance = 0;  ///< clamp of the VPL singularity [m]
  float error = 0.02f;     ///< bound on each node relative to the pixel's total
  std::uint32_t max_cut = 0;
  WorkLimits work = kWork;
  /// What hides lights for certain, and the box around the scene; none without shadows.
  const Occluder* occluders = nullptr;
  std::uint32_t occluder_count = 0;
  Box scene_bounds = {};
  const std::uint32_t* groups = nullptr;  ///< of each group its pixels, a bit each; 0: there is none
};

/// Lights groups of a tile's pixels by cuts that they share.
///
/// The pixels of a tile that lie on one surface form a group (see PictureGroups). A warp walks the trees for a group
/// with a node a lane, against the group's box, cone of normals and smallest threshold; nodes whose bound is small
/// enough for all of its pixels go to a list, and when that is full each lane sums the list for its pixel. Thresholds
/// come from an estimate of the pixels' totals by the trees' upper levels; pixels whose total then turns out too small
/// for the largest bound walk again, so in the end the promise holds for each. Groups that test very many nodes are
/// left to several blocks, which share out what waits, and those that are too much for these to many. Sums are in a
/// fixed order.
void cut_by_packets(Device& device, const TracedScene& traced, const PixelView& pixels, const CutJob& job,
                    bool shadow_rays, const GroupList& list, const SumView& sums, const CutView& cuts);

}  // namespace lightcuts::cuda
