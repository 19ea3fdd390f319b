#include "cpu/cut/flat_group.h"

#include <algorithm>
#include <cmath>

namespace lightcuts {
namespace {

Vec3 lane_of(const PacketVec3& v, int lane) { return {v.x[lane], v.y[lane], v.z[lane]}; }

/// The unit vector along v within the plane, or any other in it where v has hardly a part there.
Vec3 within_plane(Vec3 v, Vec3 ng) {
  const Vec3 part = v - ng * dot(ng, v);
  if (length_sq(part) > 1e-4f * length_sq(v)) return normalize(part);
  const Vec3 other = std::fabs(ng.x) < 0.6f ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  return normalize(cross(ng, other));
}

}  // namespace

FlatReceivers flat_receivers(std::span<const SurfacePacket> packets, const PixelGroup& group) {
  const auto receivers_of = [&](int i) -> const ReceiverPacket& {
    return packets[group.pixels[i] / kPacketSize].receivers;
  };
  const auto way_to = [&, first = lane_of(receivers_of(0).position, group.pixels[0] % kPacketSize)](int i) {
    return lane_of(receivers_of(i).position, group.pixels[i] % kPacketSize) - first;
  };
  const Vec3 first = lane_of(receivers_of(0).position, group.pixels[0] % kPacketSize);
  FlatReceivers flat{};
  flat.ng = lane_of(receivers_of(0).ng, group.pixels[0] % kPacketSize);
  flat.reach = kInfinity;

  // How the position grows with column and row, by regression.
  Vec3 by_column, by_row;
  float columns = 0, rows = 0, off = 0;
  for (int i = 0; i < group.count; ++i) {
    columns += static_cast<float>(tile_x(group.pixels[i] / kPacketSize, group.pixels[i] % kPacketSize));
    rows += static_cast<float>(tile_y(group.pixels[i] / kPacketSize, group.pixels[i] % kPacketSize));
  }
  const float share = 1 / static_cast<float>(group.count);
  for (int i = 0; i < group.count; ++i) {
    const int packet = group.pixels[i] / kPacketSize, lane = group.pixels[i] % kPacketSize;
    if (length_sq(lane_of(receivers_of(i).ng, lane) - flat.ng) > 1e-10f) return flat;
    const Vec3 way = way_to(i);
    by_column += way * (static_cast<float>(tile_x(packet, lane)) - share * columns);
    by_row += way * (static_cast<float>(tile_y(packet, lane)) - share * rows);
    off = max_of(off, std::fabs(dot(way, flat.ng)));
  }
  const Vec3 a = within_plane(by_column, flat.ng);
  Vec3 b = within_plane(by_row, flat.ng);
  float area = dot(cross(a, b), flat.ng);
  if (!(std::fabs(area) > 0.1f)) {
    b = cross(flat.ng, a);
    area = 1;
  }

  float s_lo = kInfinity, s_hi = -kInfinity, t_lo = kInfinity, t_hi = -kInfinity;
  for (int i = 0; i < group.count; ++i) {
    const Vec3 way = way_to(i);
    const float s = dot(cross(way, b), flat.ng) / area, t = dot(cross(a, way), flat.ng) / area;
    s_lo = min_of(s_lo, s), s_hi = max_of(s_hi, s);
    t_lo = min_of(t_lo, t), t_hi = max_of(t_hi, t);
  }
  const float half_s = 0.5f * (s_hi - s_lo), half_t = 0.5f * (t_hi - t_lo), reach = half_s + half_t;
  flat.middle = first + a * (0.5f * (s_lo + s_hi)) + b * (0.5f * (t_lo + t_hi));
  flat.half_a = a * half_s;
  flat.half_b = b * half_t;
  // Positions are off their triangle by what rounding may be.
  if (off <= kFlatness * reach + 1e-6f * max_component(absolute(first))) flat.reach = reach;
  flat.off = off;
  return flat;
}

bool lights_none(const FlatReceivers& receivers, const Vpl& vpl, bool flat_normals) {
  const Vec3 to = receivers.middle - vpl.position;
  const float slack = 2 * kFlatness * receivers.reach + 1e-5f * max_component(absolute(to));
  if (flat_normals && dot(receivers.ng, to) > slack) return true;
  return dot(vpl.axis, to) + std::fabs(dot(vpl.axis, receivers.half_a)) + std::fabs(dot(vpl.axis, receivers.half_b)) <
         -slack;
}

}  // namespace lightcuts
