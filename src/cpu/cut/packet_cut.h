#pragma once

#include <array>
#include <vector>

#include "cpu/cut/cut_context.h"
#include "cpu/cut/cut_kernels.h"

namespace lightcuts {

/// Nodes of the trees that together hold every light, the brightest split first: a first guess of what a pixel gets.
struct Frontier {
  std::array<std::vector<ChosenNode>, 3> nodes;  ///< by LightKind
};

/// At most `size` nodes of each tree.
Frontier make_frontier(const LightTrees& trees, std::uint32_t size);

/// Hears which nodes a packet's cuts are made of; for tests.
class CutListener {
 public:
  virtual ~CutListener() = default;
  virtual void start(std::uint32_t lanes) = 0;  ///< forget what these pixels chose so far
  virtual void chosen(LightKind kind, ChosenNode node) = 0;
};

/// The instruments of a packet cut. Everything referred to must outlive it.
struct PacketTools {
  const CutContext& context;
  const Frontier& frontier;
  const CutKernels& cut;
  const ShadeKernels& shade;
  CutListener* listener = nullptr;
};

/// How much of the frontier's unshadowed light reached the pixels lit before: neighbours are alike.
struct Arrival {
  double ratio = -1;  ///< below 0: not known yet
};

/// What a packet's cuts left.
struct PacketLight {
  Vec3T<double> light[kPacketSize];  ///< sum [W/m^2]; times albedo / pi it is reflected radiance
  double lost[kPacketSize] = {};     ///< luminance that the clamp took
  double total[kPacketSize] = {};    ///< luminance of the reflected light, times pi
  float largest_bound[kPacketSize] = {};
  float size[kPacketSize] = {};
  std::uint64_t pairs = 0, rays = 0, visits = 0, rounds = 0;
};

/// Cuts of sixteen pixels that walk the trees together.
///
/// A first guess of each pixel's total gives it a threshold; every node above is split, whatever the order. Pixels whose
/// total then turns out too small for the largest bound in their cut walk again with a threshold from the new total, so
/// in the end the promise holds for each. With a largest cut, thresholds are raised until the cuts fit.
void cut_packet(const PacketTools& tools, const SurfacePacket& packet, Arrival& arrival, PacketLight& out);

}  // namespace lightcuts
