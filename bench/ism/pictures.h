#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "backend/emitter_table.h"
#include "bench_scene.h"
#include "cpu/all_lights.h"
#include "cpu/film.h"
#include "cpu/ism/shadow_map_set.h"
#include "cpu/progress.h"
#include "cpu/shade_picture.h"
#include "cpu/simd/isa.h"
#include "lightcuts/compare.h"
#include "oracle/lookup_rules.h"

namespace lightcuts {

/// Visibility of VPLs by maps of any making and lookups of any rule, of other lights as they are built.
class CodesVisibility final : public PacketVisibility {
 public:
  /// `rule` and `others` must outlive this.
  CodesVisibility(const oracle::LookupRule& rule, const ShadowMapSet& others) : rule_(rule), others_(others) {}

  /// Adds the 16-bit codes of the next VPL's map.
  void add(std::vector<std::uint32_t> codes) {
    views_.push_back(others_.view_of(LightKind::vpl, static_cast<std::uint32_t>(codes_.size())));
    codes_.push_back(std::move(codes));
  }

  std::uint32_t shares(const VisibilityQuery& query, float* share) const override {
    if (query.kind != LightKind::vpl) {
      others_.shares(query.kind, query.light, query.receivers, query.candidates, share);
      return 0;
    }
    const MapView& view = views_[query.light];
    const std::vector<std::uint32_t>& codes = codes_[query.light];
    const int size = others_.maker().options().size;
    const auto fetch = [&](int x, int y) {
      return static_cast<std::uint16_t>(codes[static_cast<std::size_t>(y * size + x)]);
    };
    const ReceiverPacket& r = query.receivers;
    for (int lane = 0; lane < kPacketSize; ++lane) {
      share[lane] = 0;
      if ((query.candidates >> lane & 1u) == 0) continue;
      const Vec3 at{r.position.x[lane], r.position.y[lane], r.position.z[lane]};
      const Vec3 ng{r.ng.x[lane], r.ng.y[lane], r.ng.z[lane]};
      share[lane] = oracle::look_up_by<std::uint16_t>(rule_, view, to_local_point(view, at),
                                                      to_local_vector(view.frame, ng), size, fetch);
    }
    return 0;
  }

 private:
  const oracle::LookupRule& rule_;
  const ShadowMapSet& others_;
  std::vector<MapView> views_;
  std::vector<std::vector<std::uint32_t>> codes_;
};

/// Pictures of 128x128 pixels of a scene by the sum over all lights, to compare with those of rays.
class Pictures {
 public:
  /// The scene must outlive this.
  explicit Pictures(const BenchScene& bench)
      : bench_(bench),
        emitters_(*bench.cpu_scene),
        view_(make_view(select_camera(bench.scene, ""), kSide, kSide, 1, 1, true)),
        by_rays_(render(RayVisibility(*bench.tracer))) {}

  [[nodiscard]] Comparison compare_to_rays(const PacketVisibility& visibility) const {
    return compare(render(visibility), by_rays_);
  }

 private:
  static constexpr int kSide = 128;

  [[nodiscard]] Image render(const PacketVisibility& visibility) const {
    const ProgressFn silent;
    Progress progress(silent, "shade", 1);
    const TileSource source{view_, bench_.cpu_scene->view(), *bench_.tracer, emitters_.view()};
    const AllLights lighter(shade_kernels(selected_isa()), bench_.lights, &visibility,
                            0.01f * bench_.cpu_scene->view().diagonal);
    Film film(kSide, kSide);
    for_each_tile(view_, film, progress, lit_tile(source, lighter, progress));
    return film.image(1);
  }

  const BenchScene& bench_;
  EmitterTable emitters_;
  View view_;
  Image by_rays_;
};

}  // namespace lightcuts
