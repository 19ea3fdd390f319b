#include "cpu/cut/pixels_of_group.h"

namespace lightcuts {
namespace {

/// Lights added in single precision: so few that their sum loses nothing that matters.
constexpr std::size_t kBlock = 256;
/// Largest finite weight: an infinite one would make nonsense of clusters that are dark.
constexpr float kLargestWeight = 1e38f;

Vec3 lane_of(const PacketVec3& v, int lane) { return {v.x[lane], v.y[lane], v.z[lane]}; }
void set_lane(PacketVec3& packet, int lane, Vec3 v) {
  packet.x[lane] = v.x;
  packet.y[lane] = v.y;
  packet.z[lane] = v.z;
}

void sum_block(const CutTask& task, LightKind kind, const CutContext& context, const CutKernels& kernels, CutSum& sum) {
  switch (kind) {
    case LightKind::vpl:
      return kernels.sum_vpls(task, context.min_distance_sq, sum);
    case LightKind::point:
      return kernels.sum_points(task, context.lights.points.data(), sum);
    case LightKind::directional:
      return kernels.sum_directionals(task, context.lights.directionals.data(), sum);
  }
}

}  // namespace

GroupPixels::GroupPixels(std::span<const SurfacePacket> tile, const PixelGroup& group)
    : packet_count_((group.count + kPacketSize - 1) / kPacketSize) {
  for (int p = 0; p < packet_count_; ++p) {
    ReceiverPacket& receivers = receivers_[p];
    receivers = {};
    weights_[p] = {};
    receivers.flat = true;
    const int count = std::min(kPacketSize, group.count - p * kPacketSize);
    pending_[p] = (1u << count) - 1u;
    receivers.active = pending_[p];
    for (int lane = 0; lane < count; ++lane) {
      const std::uint8_t pixel = group.pixels[p * kPacketSize + lane];
      const SurfacePacket& from = tile[pixel / kPacketSize];
      const int at = pixel % kPacketSize;
      const Vec3 ns = lane_of(from.receivers.ns, at), ng = lane_of(from.receivers.ng, at);
      set_lane(receivers.position, lane, lane_of(from.receivers.position, at));
      set_lane(receivers.ns, lane, ns);
      set_lane(receivers.ng, lane, ng);
      receivers.flat = receivers.flat && ns == ng;
      const Vec3 weights = reflected_weights(lane_of(from.albedo, at));
      set_lane(weights_[p], lane, weights);
      pixels_[p * kPacketSize + lane].weight = weights.x + weights.y + weights.z;
    }
  }
}

double GroupPixels::reflected(int i, const Vec3T<double>& light) const {
  const Vec3 w = lane_of(weights_[i / kPacketSize], i % kPacketSize);
  const double total = w.x * light.x + w.y * light.y + w.z * light.z;
  return total > 0 ? total : 0;
}

Aim GroupPixels::aim(float level_ratio) {
  double level = -1;
  const auto key = [&](int i) { return pixels_[i].threshold / pixels_[i].weight; };
  for_each_pending([&](int i) {
    if (pixels_[i].weight > 0) level = std::max(level, key(i));
  });
  Aim aim{};
  for_each_pending([&](int i) {
    const bool black = !(pixels_[i].weight > 0);
    if (!black && key(i) * level_ratio < level) return;
    aim.packets |= 1u << (i / kPacketSize);
    ++pixels_[i].rounds;
    if (black) return;
    const Vec3 w = lane_of(weights_[i / kPacketSize], i % kPacketSize);
    const auto relative = [&](float weight) {
      if (!(weight > 0)) return 0.0f;
      const double value = weight / pixels_[i].threshold;
      return value < kLargestWeight ? static_cast<float>(value) : kLargestWeight;
    };
    aim.weights = max_of(aim.weights, Vec3{relative(w.x), relative(w.y), relative(w.z)});
  });
  return aim;
}

std::uint64_t GroupPixels::add(int packet, const LitNodes& nodes, const CutContext& context,
                               const CutKernels& kernels) {
  for (std::size_t first = 0; first < nodes.count; first += kBlock) {
    const CutTask task{receivers_[packet], weights_[packet], nodes.lights + first,
                       nodes.shares == nullptr ? nullptr : nodes.shares + first, std::min(kBlock, nodes.count - first)};
    CutSum sum;
    sum_block(task, nodes.kind, context, kernels, sum);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      PixelState& pixel = pixels_[packet * kPacketSize + lane];
      pixel.light += Vec3T<double>{sum.sum.light.x[lane], sum.sum.light.y[lane], sum.sum.light.z[lane]};
      pixel.lost += sum.sum.lost[lane];
      pixel.largest = std::max(pixel.largest, sum.largest[lane]);
    }
  }
  return nodes.count * static_cast<std::uint64_t>(std::popcount(pending_[packet]));
}

void GroupPixels::start_from_leaves(int packet) {
  for (int i = packet * kPacketSize; i < (packet + 1) * kPacketSize; ++i) {
    pixels_[i].light = pixels_[i].fixed;
    pixels_[i].lost = pixels_[i].fixed_lost;
    pixels_[i].largest = 0;
  }
}

void GroupPixels::start_from_nothing(int packet) {
  for (int i = packet * kPacketSize; i < (packet + 1) * kPacketSize; ++i) {
    pixels_[i].light = {0, 0, 0};
    pixels_[i].lost = 0;
  }
}

void GroupPixels::keep_as_leaves(int packet) {
  for (int i = packet * kPacketSize; i < (packet + 1) * kPacketSize; ++i) {
    pixels_[i].fixed += pixels_[i].light;
    pixels_[i].fixed_lost += pixels_[i].lost;
  }
}

}  // namespace lightcuts
