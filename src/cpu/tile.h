#pragma once

#include <array>
#include <cstdint>

#include "cpu/simd/packet.h"
#include "kernels/camera.h"
#include "kernels/emitters.h"
#include "kernels/surface.h"

namespace lightcuts {

class RayTracer;

// A picture is lit tile by tile: 8x8 pixels, four packets of 4x4. A tile is a task of one thread, the g-buffer that
// every way of lighting starts from, and the group of pixels that walks a light tree together.

inline constexpr int kTileSide = 2 * kPacketSide;
inline constexpr int kTilePackets = 4;
inline constexpr int kTilePixels = kTilePackets * kPacketSize;

/// What 16 pixels see.
struct SurfacePacket {
  ReceiverPacket receivers;
  PacketVec3 albedo;
  PacketVec3 seen;                   ///< radiance seen directly: of an emitter, or of the environment past the scene
  float depth[kPacketSize];          ///< distance along the view direction [m]; infinite where nothing was hit
  std::uint32_t inside_picture = 0;  ///< bit i: pixel i belongs to the picture
};

/// The g-buffer of one tile for one sample a pixel.
struct Tile {
  int x0 = 0, y0 = 0;  ///< top left pixel
  std::array<SurfacePacket, kTilePackets> packets;
};

/// Pixel of lane `lane` of packet `packet`, relative to the tile's corner.
constexpr int tile_x(int packet, int lane) { return (packet % 2) * kPacketSide + lane % kPacketSide; }
constexpr int tile_y(int packet, int lane) { return (packet / 2) * kPacketSide + lane / kPacketSide; }

/// What lighting a tile yields. Sums are in double precision: there may be millions of lights.
struct TileLight {
  Vec3T<double> light[kTilePixels];  ///< sum over the lights [W/m^2]; times albedo / pi it is reflected radiance
  double lost[kTilePixels] = {};     ///< luminance that the clamp of the VPL distance took
  std::uint64_t pairs = 0;           ///< receiver-light pairs evaluated
  std::uint64_t rays = 0;            ///< shadow rays traced
  // Of methods that choose a cut; 0 where there is none.
  std::uint32_t cut_size[kTilePixels] = {};  ///< nodes
  float cut_bound[kTilePixels] = {};         ///< largest bound of a node relative to the pixel's total
  bool cut_at_limit[kTilePixels] = {};       ///< the largest cut allowed came before the promised bound
};

/// How a picture is looked at and sampled.
struct View {
  CameraView camera;
  Vec3 axis;  ///< unit, the way the camera looks
  int width = 0, height = 0;
  std::uint32_t sample_count = 1;
  std::uint64_t seed = 1;
  bool centred = true;  ///< the only sample of a pixel goes through its centre
};
View make_view(const Camera& camera, int width, int height, std::uint32_t sample_count, std::uint64_t seed,
               bool centred);

/// What one sample a pixel sees: the g-buffer of the tile whose corner is (x0, y0).
Tile trace_tile(const View& view, int x0, int y0, std::uint32_t sample, const SceneView& scene, const RayTracer& tracer,
                const EmitterView& emitters);

}  // namespace lightcuts
