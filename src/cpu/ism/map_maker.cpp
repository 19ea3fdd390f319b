#include "cpu/ism/map_maker.h"

#include <algorithm>
#include <new>

#include "cpu/ism/fill_holes.h"
#include "kernels/draw_map.h"

namespace lightcuts {
namespace {

constexpr std::size_t kPadding = 16;  // entries past the last that kernels may touch

struct FreeAligned {
  void operator()(float* floats) const { ::operator delete[](floats, std::align_val_t{64}); }
};

}  // namespace

struct MapMaker::Scratch {
  std::unique_ptr<float[], FreeAligned> nearness;
  FillScratch<std::uint16_t> fill16;
  FillScratch<std::uint32_t> fill32;
  std::vector<float> chosen;  ///< points that the noise chose
  std::vector<std::uint32_t> shapes;
};

MapMaker::MapMaker(const IsmKernels& kernels, const SurfacePoints& points, const LightSet& lights,
                   const ShadowMapOptions& options)
    : kernels_(kernels), points_(points), lights_(lights), options_(options) {}

MapMaker::~MapMaker() = default;

MapMaker::Scratch& MapMaker::scratch() const {
  std::unique_ptr<Scratch>& mine = scratch_.local();
  if (mine == nullptr) {
    mine = std::make_unique<Scratch>();
    mine->nearness.reset(new (std::align_val_t{64}) float[nearness_floats(options_.size)]);
  }
  return *mine;
}

std::uint64_t MapMaker::bytes_per_map(const ShadowMapOptions& options) {
  const auto side = static_cast<std::uint64_t>(options.size);
  return side * side * static_cast<std::uint64_t>(options.depth_bits) / 8;
}

std::uint64_t MapMaker::maps_of(const LightSet& lights) {
  std::uint64_t count = lights.vpls.size() + lights.directionals.size();
  for (const PointRecord& light : lights.points) count += static_cast<std::uint64_t>(point_map_count(light.cos_outer));
  return count;
}

int MapMaker::maps_for(LightKind kind, std::uint32_t light) const {
  return kind == LightKind::point ? point_map_count(lights_.points[light].cos_outer) : 1;
}

MapView MapMaker::view_of(LightKind kind, std::uint32_t light, int which) const {
  if (kind == LightKind::vpl) {
    return vpl_map_view(lights_.vpls[light].position, lights_.vpls[light].axis, points_.bounds());
  }
  if (kind == LightKind::directional) {
    return orthographic_view(lights_.directionals[light].direction, points_.bounds());
  }
  const PointRecord& point = lights_.points[light];
  return point_map_view(point.position, point.axis, points_.bounds(), options_.size, which);
}

MapRecord MapMaker::record_of(LightKind kind, std::uint32_t light, int which) const {
  const MapView view = view_of(kind, light, which);
  return options_.depth_bits == 16 ? make_map_record<std::uint16_t>(view, options_.size)
                                   : make_map_record<std::uint32_t>(view, options_.size);
}

void MapMaker::make(LightKind kind, std::uint32_t light, int which, void* codes) const {
  Scratch& work = scratch();
  const MapView view = view_of(kind, light, which);
  std::fill_n(work.nearness.get(), nearness_floats(options_.size), 0.0f);
  draw(kind, light, view, work);
  if (options_.depth_bits == 16) {
    auto* to = static_cast<std::uint16_t*>(codes);
    kernels_.encode16(work.nearness.get(), view, options_.size, to);
    fill_holes(to, options_.size, options_.levels, options_.fill, work.fill16);
  } else {
    auto* to = static_cast<std::uint32_t*>(codes);
    kernels_.encode32(work.nearness.get(), view, options_.size, to);
    fill_holes(to, options_.size, options_.levels, options_.fill, work.fill32);
  }
}

/// Draws the map's points: a block of the order from a random start, or the study's subset by a noise of point and light.
void MapMaker::draw(LightKind kind, std::uint32_t light, const MapView& view, Scratch& work) const {
  const std::size_t all = points_.size(), wanted = std::min<std::size_t>(points_.options().per_map, all);
  if (all == 0) return;
  const PointArrays& arrays = points_.arrays();
  const std::uint32_t stream = map_stream(light, static_cast<std::uint32_t>(kind), map_seed(options_.seed));
  if (options_.choice == PointChoice::block) {
    const std::size_t start = block_start(stream, static_cast<std::uint32_t>(all));
    const std::size_t until_end = std::min(wanted, all - start);
    kernels_.draw(arrays, start, until_end, view, options_.size, work.nearness.get());
    kernels_.draw(arrays, 0, wanted - until_end, view, options_.size, work.nearness.get());
    return;
  }

  const double share = static_cast<double>(wanted) / static_cast<double>(all);
  std::size_t count = 0;
  const std::size_t stride = all + kPadding;
  work.chosen.resize(8 * stride);
  work.shapes.resize(stride);
  const float* from[8] = {
      arrays.x,          arrays.y, arrays.z, arrays.normal_x, arrays.normal_y, arrays.normal_z, arrays.sink_in_front,
      arrays.sink_behind};
  for (std::size_t i = 0; i < all; ++i) {
    if (!noise_chooses(static_cast<std::uint32_t>(i), stream, share)) continue;
    for (std::size_t c = 0; c < 8; ++c) work.chosen[c * stride + count] = from[c][i];
    work.shapes[count++] = arrays.shape[i];
  }
  const float* c = work.chosen.data();
  const PointArrays chosen{c,
                           c + stride,
                           c + 2 * stride,
                           c + 3 * stride,
                           c + 4 * stride,
                           c + 5 * stride,
                           c + 6 * stride,
                           c + 7 * stride,
                           work.shapes.data(),
                           arrays.shapes};
  kernels_.draw(chosen, 0, count, view, options_.size, work.nearness.get());
}

std::uint32_t behind_light(const ReceiverPacket& receivers, std::uint32_t candidates, const MapRecord& front) {
  std::uint32_t behind = 0;
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const Vec3 at{receivers.position.x[lane], receivers.position.y[lane], receivers.position.z[lane]};
    behind |= (dot(at - front.origin, front.z) < 0 ? 1u : 0u) << lane;
  }
  return behind & candidates;
}

}  // namespace lightcuts
