#include "kernels/map_lookup.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdio>
#include <random>
#include <vector>

#include "cpu/simd/isa.h"
#include "cpu/simd/ism_kernels.h"
#include "kernels/group_lookup.h"

namespace lightcuts {
namespace {

Vec3 random_direction(std::mt19937& dice) {
  std::normal_distribution<float> normal;
  return normalize(Vec3{normal(dice), normal(dice), normal(dice)});
}

/// Random maps, and receivers on planes through random places: the lookup of threads against the one by definition.
template <class Depth, bool Paraboloid, int Size>
void compare_lookups(int size) {
  std::mt19937 dice(static_cast<unsigned>(size) + sizeof(Depth));
  std::uniform_real_distribution<float> unit(0, 1);
  const Box bounds{{-3, -1, -4}, {5, 3, 4}};
  int receivers = 0, differ = 0, facing_differ = 0;
  double passed = 0;
  constexpr float kRounding = 1e-6f;  // of a place on the map, whose whole part is `size` texels
  const auto side = static_cast<float>(size);
  for (int round = 0; round < 200; ++round) {
    const Vec3 origin = bounds.lo + (bounds.hi - bounds.lo) * Vec3{unit(dice), unit(dice), unit(dice)};
    const Vec3 axis = random_direction(dice);
    const MapView view = Paraboloid ? paraboloid_view(origin, axis, bounds) : orthographic_view(axis, bounds);
    const MapRecord map = make_map_record<Depth>(view, size);
    std::vector<Depth> codes(static_cast<std::size_t>(size * size));
    for (Depth& code : codes) {
      code = unit(dice) < 0.2f ? kNoDepth<Depth> : static_cast<Depth>(unit(dice) * 0.6f * kDepthSteps<Depth>);
    }
    for (int i = 0; i < 200; ++i) {
      const Vec3 at = bounds.lo + (bounds.hi - bounds.lo) * Vec3{unit(dice), unit(dice), unit(dice)};
      const Vec3 ng = random_direction(dice);
      const Vec3 local = to_local_point(view, at);
      if (Paraboloid && !(local.z > 0)) continue;
      const auto fetch = [&](int x, int y) { return codes[static_cast<std::size_t>(y * size + x)]; };
      const float expected = lookup_visibility<Depth>(view, local, to_local_vector(view.frame, ng), size, fetch);
      const float got = look_up_map<Depth, Paraboloid, Size>(map, to_map(map, at), ng, size, codes.data());
      if constexpr (Paraboloid) {
        // The loops over lights turn the normal away from the light before they ask.
        const Vec3 seen = to_map(map, at), turned = dot(ng, at - origin) < 0 ? -ng : ng;
        const Vec3 normal{dot(turned, map.x), dot(turned, map.y), dot(turned, map.z)};
        const float facing =
            look_up_facing<Depth, Size>(map, seen, normal, dot(seen, seen), dot(seen, normal), size, codes.data());
        facing_differ += std::abs(facing - expected) > kRounding * side ? 1 : 0;
      }
      ++receivers;
      passed += expected;
      differ += std::abs(got - expected) > kRounding * side ? 1 : 0;
    }
  }
  std::printf("  %d texels, %d bits: %d of %d lookups differ, %.0f %% pass\n", size,
              static_cast<int>(8 * sizeof(Depth)), differ, receivers, 100 * passed / receivers);
  EXPECT_LE(differ, receivers / 500);  // a tap on the edge of a texel or of a depth code
  EXPECT_LE(facing_differ, receivers / 500);
  EXPECT_GT(passed, 0.1 * receivers);
  EXPECT_LT(passed, 0.9 * receivers);
}

TEST(MapLookup, AgreesWithTheDefinition) {
  for (const int size : {4, 32, 128}) {
    compare_lookups<std::uint16_t, true, 0>(size);
    compare_lookups<std::uint32_t, true, 0>(size);
    compare_lookups<std::uint16_t, false, 0>(size);
    compare_lookups<std::uint32_t, false, 0>(size);
  }
  compare_lookups<std::uint16_t, true, 32>(32);
  compare_lookups<std::uint16_t, true, 64>(64);
}

/// From a place in a room with a box in it [m].
float depth_in_room(Vec3 from, Vec3 way) {
  float nearest = kInfinity;
  const auto meet = [&](float lo, float hi, int axis, const Box& side) {
    for (const float plane : {lo, hi}) {
      const float t = (plane - component(from, axis)) / component(way, axis);
      if (!(t > 1e-4f) || t > nearest) continue;
      const Vec3 at = from + way * t;
      bool inside = true;
      for (int k = 0; k < 3; ++k) {
        inside = inside && (k == axis ||
                            (component(at, k) >= component(side.lo, k) && component(at, k) <= component(side.hi, k)));
      }
      if (inside) nearest = t;
    }
  };
  for (const Box& side : {Box{{-3, -1, -4}, {5, 3, 4}}, Box{{-1, -1, -1}, {1, 1, 1}}}) {
    for (int axis = 0; axis < 3; ++axis) meet(component(side.lo, axis), component(side.hi, axis), axis, side);
  }
  return nearest;
}

/// A map of a room with a box in it, which receivers on walls, floor and box ask as a group and one by one.
template <class Depth, int Size>
void compare_groups(float extent) {
  std::mt19937 dice(Size);
  std::uniform_real_distribution<float> unit(0, 1), both(-1, 1);
  const Box room{{-3, -1, -4}, {5, 3, 4}}, box{{-1, -1, -1}, {1, 1, 1}};
  int groups = 0, known = 0, placed = 0, one = 0, wrong = 0, wrong_placed = 0, wrong_one = 0;
  for (int round = 0; round < 60; ++round) {
    Vec3 origin;
    do {
      origin = room.lo + (room.hi - room.lo) * Vec3{unit(dice), unit(dice), unit(dice)};
    } while (std::abs(origin.x) < 1.1f && origin.y < 1.1f && std::abs(origin.z) < 1.1f);
    const MapView view = paraboloid_view(origin, random_direction(dice), room);
    const MapRecord map = make_map_record<Depth>(view, Size);
    std::vector<Depth> codes(Size * Size);
    for (int j = 0; j < Size; ++j) {
      for (int i = 0; i < Size; ++i) {
        const Vec3 w = unproject_paraboloid(texel_centre(i, Size), texel_centre(j, Size));
        const Vec3 way = view.frame.x * w.x + view.frame.y * w.y + view.frame.z * w.z;
        codes[static_cast<std::size_t>(j * Size + i)] = encode_depth<Depth>(depth_in_room(origin, way), map.steps);
      }
    }
    for (int i = 0; i < 400; ++i) {
      const int axis = static_cast<int>(unit(dice) * 3), other = (axis + 1) % 3, third = (axis + 2) % 3;
      const Box& at = unit(dice) < 0.5f ? room : box;
      FlatReceivers group{};
      float middle[3], a[3] = {}, b[3] = {}, ng[3] = {};
      for (int k = 0; k < 3; ++k)
        middle[k] = component(at.lo, k) + unit(dice) * (component(at.hi, k) - component(at.lo, k));
      middle[axis] = unit(dice) < 0.5f ? component(at.lo, axis) : component(at.hi, axis);
      a[other] = extent * both(dice), a[third] = extent * both(dice);
      b[other] = extent * both(dice), b[third] = extent * both(dice);
      ng[axis] = unit(dice) < 0.5f ? -1.0f : 1.0f;
      group.middle = {middle[0], middle[1], middle[2]};
      group.half_a = {a[0], a[1], a[2]};
      group.half_b = {b[0], b[1], b[2]};
      group.ng = {ng[0], ng[1], ng[2]};
      group.reach = length(group.half_a) + length(group.half_b);
      const float shared = look_up_group<Depth, Size>(map, group, Size, codes.data());
      const GroupLook look = look_at_group<Depth, Size>(map, group, Size, codes.data());
      const std::uint32_t texels = look.texels;
      if (dot(group.middle - origin, map.z) < 0) continue;
      ++groups;
      if (texels == kGroupUnsure) continue;
      ++(shared == kEachItsOwn ? placed : known);
      const bool is_one = shared == kEachItsOwn && std::popcount(look.own) == 1;
      one += is_one ? 1 : 0;
      for (int k = 0; k < 24; ++k) {
        // The corners are the farthest.
        const float s = k < 4 ? (k % 2 == 0 ? -1.0f : 1.0f) : both(dice),
                    t = k < 4 ? (k < 2 ? -1.0f : 1.0f) : both(dice);
        const Vec3 local = to_map(map, group.middle + group.half_a * s + group.half_b * t);
        if (!(local.z > 0)) continue;  // no light arrives
        const float expected = look_up_map<Depth, true, Size>(map, local, group.ng, Size, codes.data());
        if (shared != kEachItsOwn) {
          wrong += std::abs(shared - expected) > 1e-5f ? 1 : 0;
        } else {
          const float share = share_by_place<Size>(texels, local, dot(local, local), Size);
          wrong_placed += std::abs(share - expected) > 1e-3f ? 1 : 0;
          if (!is_one) continue;
          const auto own = static_cast<std::uint32_t>(std::countr_zero(look.own));
          const float scale = 0.5f * Size / (length(local) + local.z), centre = 0.5f * Size - 0.5f;
          const float x = local.x * scale + centre - static_cast<float>(group_column(texels) + own % 3);
          const float y = local.y * scale + centre - static_cast<float>(group_row(texels) + own / 3);
          const OneTexelShare of = share_of_one_texel(texels, own);
          const float by_one =
              of.at_centre + of.x_slope * x + of.x_bend * std::abs(x) + of.y_slope * y + of.y_bend * std::abs(y);
          wrong_one += std::abs(by_one - expected) > 1e-4f ? 1 : 0;
        }
      }
    }
  }
  std::printf(
      "  %d texels, groups of %g m: one look serves all in %d %%, with their places in %d %%, within one texel in %d "
      "%%; "
      "%d, %d and %d of %d, %d and %d wrong\n",
      Size, extent, 100 * known / groups, 100 * placed / groups, 100 * one / groups, wrong, wrong_placed, wrong_one,
      24 * known, 24 * placed, 24 * one);
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(wrong_placed, 24 * placed / 5000);  // in the middle between two texels
  EXPECT_EQ(wrong_one, 0);
  EXPECT_GT(one, extent < 0.02f ? groups / 100 : 0);
  EXPECT_GT(placed, extent < 0.02f ? groups / 50 : 0);
  EXPECT_GT(known, extent < 0.02f ? 3 * groups / 4 : groups / 50);
}

TEST(GroupLookup, SaysWhatEveryReceiverWouldSee) {
  compare_groups<std::uint16_t, 32>(0.002f);
  compare_groups<std::uint16_t, 32>(0.01f);
  compare_groups<std::uint16_t, 32>(0.05f);
  compare_groups<std::uint16_t, 32>(0.3f);
  compare_groups<std::uint16_t, 128>(0.01f);
  compare_groups<std::uint32_t, 64>(0.01f);
}

/// Lights in the room with their maps.
struct RoomMaps {
  static constexpr int kSize = 64;
  std::vector<MapRecord> records;
  std::vector<std::vector<std::uint16_t>> codes;
  std::vector<GroupMap> maps;

  RoomMaps(int count, std::mt19937& dice) {
    std::uniform_real_distribution<float> unit(0, 1);
    const Box room{{-3, -1, -4}, {5, 3, 4}};
    for (int n = 0; n < count; ++n) {
      Vec3 origin;
      do {
        origin = room.lo + (room.hi - room.lo) * Vec3{unit(dice), unit(dice), unit(dice)};
      } while (std::abs(origin.x) < 1.1f && origin.y < 1.1f && std::abs(origin.z) < 1.1f);
      const MapView view = paraboloid_view(origin, random_direction(dice), room);
      records.push_back(make_map_record<std::uint16_t>(view, kSize));
      auto& map = codes.emplace_back();
      for (int t = 0; t < kSize * kSize; ++t) {
        const Vec3 w = unproject_paraboloid(texel_centre(t % kSize, kSize), texel_centre(t / kSize, kSize));
        const Vec3 way = view.frame.x * w.x + view.frame.y * w.y + view.frame.z * w.z;
        map.push_back(encode_depth<std::uint16_t>(depth_in_room(origin, way), records.back().steps));
      }
      map.resize(map.size() + 8);  // what may be read past the last one
    }
    for (std::size_t i = 0; i < records.size(); ++i) maps.push_back({&records[i], codes[i].data()});
  }
};

TEST(GroupLookup, OfManyMapsAtOnceSaysTheSame) {
  std::mt19937 dice(5);
  std::uniform_real_distribution<float> unit(0, 1), both(-1, 1);
  const RoomMaps room(13, dice);
  const int count = static_cast<int>(room.maps.size());
  for (const Isa isa : available_isas()) {
    const IsmKernels& kernels = ism_kernels(isa);
    int known = 0, known_to_one = 0, asked = 0, wrong = 0;
    for (int i = 0; i < 400; ++i) {
      FlatReceivers group{};
      const float wall = unit(dice) < 0.5f ? -4.0f : 1.0f;  // a wall, or the box
      group.middle = {wall < 0 ? 8 * unit(dice) - 3 : both(dice), wall < 0 ? 4 * unit(dice) - 1 : both(dice), wall};
      const float extent = i % 2 == 0 ? 0.005f : 0.03f;
      group.half_a = Vec3{both(dice), both(dice), 0} * extent;
      group.half_b = Vec3{both(dice), both(dice), 0} * extent;
      group.ng = {0, 0, 1};
      group.reach = length(group.half_a) + length(group.half_b);
      alignas(64) float shares[kPacketSize];
      kernels.look_up_group(group, room.maps.data(), count, RoomMaps::kSize, shares);
      for (int n = 0; n < count; ++n) {
        const MapRecord& map = room.records[static_cast<std::size_t>(n)];
        const std::uint16_t* codes = room.codes[static_cast<std::size_t>(n)].data();
        const float alone = look_up_group<std::uint16_t>(map, group, RoomMaps::kSize, codes);
        ++asked;
        known += shares[n] != kEachItsOwn ? 1 : 0;
        known_to_one += (shares[n] == kEachItsOwn) != (alone == kEachItsOwn) ? 1 : 0;
        if (shares[n] == kEachItsOwn) continue;
        if (alone != kEachItsOwn) wrong += std::abs(alone - shares[n]) > 1e-5f ? 1 : 0;
        for (int k = 0; k < 4; ++k) {
          const Vec3 at =
              group.middle + group.half_a * (k % 2 == 0 ? -1.0f : 1.0f) + group.half_b * (k < 2 ? -1.0f : 1.0f);
          const Vec3 local = to_map(map, at);
          if (!(local.z > 0)) continue;
          const float expected = look_up_map<std::uint16_t, true>(map, local, group.ng, RoomMaps::kSize, codes);
          wrong += std::abs(shares[n] - expected) > 1e-5f ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0) << isa_name(isa);
    EXPECT_GT(known, asked * 3 / 4) << isa_name(isa);
    EXPECT_LT(known_to_one, asked / 500) << isa_name(isa);
  }
}

/// A light 2 m above a floor, and a map of it that holds a sheet at `height` above the floor from texel `first` on.
struct SheetMap {
  static constexpr int kSize = 32;
  MapView view = paraboloid_view({0, 0, 2}, {0, 0, -1}, {{-3, -3, 0}, {3, 3, 2}});
  MapRecord map = make_map_record<std::uint16_t>(view, kSize);
  std::vector<std::uint16_t> codes;

  SheetMap(int first, float height) {
    for (int t = 0; t < kSize * kSize; ++t) {
      const Vec3 w = unproject_paraboloid(texel_centre(t % kSize, kSize), texel_centre(t / kSize, kSize));
      const float away = (t % kSize >= first ? 2 - height : 2) / max_of(w.z, 0.01f);
      codes.push_back(encode_depth<std::uint16_t>(away, map.steps));
    }
  }
  /// What arrives at the floor where the map's coordinate along x is `column` texels, in the middle of row 16.
  [[nodiscard]] float share(float column) const {
    const float u = 2 * column / kSize - 1, v = texel_centre(16, kSize);
    const Vec3 w = unproject_paraboloid(u, v) * 1.0f;
    const Vec3 local = w * (2 / w.z);
    const Vec3 ng{dot(Vec3{0, 0, 1}, map.x), dot(Vec3{0, 0, 1}, map.y), dot(Vec3{0, 0, 1}, map.z)};
    const float along = dot(local, -ng);
    const float share =
        look_up_facing<std::uint16_t, kSize>(map, local, -ng, dot(local, local), along, kSize, codes.data());
    EXPECT_NEAR(share, (look_up_map<std::uint16_t, true>(map, local, {0, 0, 1}, kSize, codes.data())), 1e-5f);
    return share;
  }
};

TEST(MapLookup, AShadowsEdgeIsATexelWide) {
  const SheetMap sheet(20, 1);
  // Texel 20 lies from 20 to 21. The centres on both sides of the edge are 19.5 and 20.5.
  EXPECT_EQ(sheet.share(18.7f), 1);
  EXPECT_NEAR(sheet.share(19.5f), 1, 1e-4f);
  for (const float column : {19.6f, 19.75f, 19.9f, 20.1f, 20.25f, 20.4f}) {
    EXPECT_NEAR(sheet.share(column), 20.5f - column, 1e-4f) << column;
  }
  EXPECT_NEAR(sheet.share(20.5f), 0, 1e-4f);
  EXPECT_EQ(sheet.share(21.3f), 0);
}

TEST(MapLookup, WhatIsATexelsWidthAwayDarkensOnlyTheReceiversOwnTexel) {
  // A texel is some 27 cm wide there.
  const SheetMap low(20, 0.15f), high(20, 0.4f);
  EXPECT_EQ(low.share(19.8f), 1) << "lit, whatever the texel beside holds";
  EXPECT_NEAR(low.share(20.2f), 0.3f, 1e-4f) << "dark: the texel beside lets light pass";
  EXPECT_NEAR(high.share(19.8f), 0.7f, 1e-4f);
}

TEST(MapLookup, WithoutADepthEverythingPasses) {
  const Box bounds{{-1, -1, -1}, {1, 1, 1}};
  const MapView view = paraboloid_view({0, 0, -1}, {0, 0, 1}, bounds);
  const MapRecord map = make_map_record<std::uint16_t>(view, 16);
  const std::vector<std::uint16_t> empty(256, kNoDepth<std::uint16_t>);
  // The farthest corner, in every direction that its surface may face.
  for (const Vec3 ng : {Vec3{0, 0, -1}, normalize(Vec3{-1, -1, -1}), Vec3{-1, 0, 0}}) {
    EXPECT_EQ((look_up_map<std::uint16_t, true>(map, to_map(map, {1, 1, 1}), ng, 16, empty.data())), 1.0f);
  }
}

}  // namespace
}  // namespace lightcuts
