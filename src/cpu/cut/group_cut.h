#pragma once

#include <array>
#include <span>
#include <vector>

#include "cpu/cut/arrivals.h"
#include "cpu/cut/cut_context.h"
#include "cpu/cut/cut_kernels.h"
#include "cpu/cut/frontier.h"
#include "cpu/cut/hidden_lights.h"
#include "cpu/cut/receiver_groups.h"
#include "cpu/tile.h"

namespace lightcuts {

/// Hears which nodes the pixels' cuts are made of; for tests.
class CutListener {
 public:
  virtual ~CutListener() = default;
  /// `pixels` as in PixelGroup; bounds were those of the group.
  virtual void chosen(LightKind kind, std::uint32_t node, const ReceiverGroup<float>& group,
                      std::span<const std::uint8_t> pixels) = 0;
  /// A node that none of the pixels sees: it belongs to the cut too, but gives nothing.
  virtual void hidden(LightKind kind, std::uint32_t node, const ReceiverGroup<float>& group,
                      std::span<const std::uint8_t> pixels) = 0;
  /// A pixel's cut is complete; `leaves`: the part of its light that single lights give.
  virtual void lit(std::uint8_t /*pixel*/, const Vec3T<double>& /*leaves*/) {}
};

/// How the work is cut up: measured, see docs/results/cut.md.
struct GroupTuning {
  float extent;             ///< of a group, relative to that of lights and tile
  float cosine;             ///< as in GroupLimits
  int pixels;               ///< as in GroupLimits
  float first_factor;       ///< threshold of the first round, relative to that of the guess
  float level_ratio;        ///< pixels whose thresholds differ by less than this go on together
  UmbraLimits umbras = {};  ///< occluders that a group looks for hidden lights behind
};

/// The instruments of a group's cut. Everything referred to must outlive it.
struct CutTools {
  const CutContext& context;
  const Frontier& frontier;
  const CutKernels& cut;
  const ShadeKernels& shade;
  GroupTuning tuning;
  CutListener* listener = nullptr;
  double guess_scale = 1;  ///< for tests: falsifies the first guess
};

/// A node that a limited cut may still split.
struct SplitCandidate {
  float value;  ///< what the threshold is compared with
  LightKind kind;
  ChosenNode node;
};

/// Memory of a group's cut, passed in so that it serves many groups.
struct CutScratch {
  std::array<CutEntries, 3> entries;             ///< inner nodes of the cut, by LightKind
  std::array<CutEntries, 3> old;                 ///< the same before a round
  std::array<std::vector<ChosenNode>, 3> first;  ///< nodes of the first round
  CutEntries leaves;                             ///< leaves not added to the sums yet
  std::vector<WaitingNode> feed;
  std::vector<SplitCandidate> heap;
  UmbraScratch umbras;
  std::uint64_t groups = 0, rounds = 0, visits = 0;  ///< counted over its whole life
};

/// Cuts of the pixels of a tile, or of fewer packets, into `out`, which starts as zeros.
///
/// Pixels that are alike form a group and choose one cut together: a node is chosen when its bound is small enough for
/// all of them, and each test takes as many nodes as a register has lanes. A first guess of the totals sets the first
/// threshold; from then on nodes whose bound is too large for the totals found are split, until the promise holds for
/// every pixel. What the nodes' representatives give is kept, so the cut costs one evaluation, and at most one shadow
/// ray, a node and pixel, like a heap's. With a largest cut, the nodes of largest bound are split until it is full.
void cut_pixels(const CutTools& tools, std::span<const SurfacePacket> packets, CutScratch& scratch, TileLight& out);

}  // namespace lightcuts
