// One look at a shadow map for a whole group of receivers, a map a lane: part of ism_kernels_body.h.
// No include guard on purpose.

namespace lightcuts::LC_ISA {
namespace {

LC_LANES_FN Lanes absolute(Lanes v) { return xsimd::abs(v.value); }
LC_LANES_FN Lanes floor_of(Lanes v) { return xsimd::floor(v.value); }

/// The 3x3 texels of each map that a group's receivers may ask, as numbers.
struct GroupCodes {
  Lanes at[3][3];  ///< by row and column
};

LC_LANES_FN GroupCodes load_codes(const GroupMap* maps, int first, int count, Lanes index, int size) {
  alignas(64) float from[Lanes::kCount];
  alignas(64) std::uint64_t rows[3][Lanes::kCount];
  index.store(from);
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    const std::uint16_t* codes =
        maps[first + (lane < count ? lane : 0)].codes + static_cast<std::ptrdiff_t>(from[lane]);
    for (int row = 0; row < 3; ++row, codes += size) __builtin_memcpy(&rows[row][lane], codes, 8);
  }
  GroupCodes out;
  alignas(64) float codes[3][Lanes::kCount];
  for (int row = 0; row < 3; ++row) {
    for (int lane = 0; lane < Lanes::kCount; ++lane) {
      const std::uint64_t four = rows[row][lane];
      codes[0][lane] = static_cast<float>(static_cast<std::int32_t>(four & 0xffffu));
      codes[1][lane] = static_cast<float>(static_cast<std::int32_t>(four >> 16 & 0xffffu));
      codes[2][lane] = static_cast<float>(static_cast<std::int32_t>(four >> 32 & 0xffffu));
    }
    for (int column = 0; column < 3; ++column) out.at[row][column] = Lanes::load(codes[column]);
  }
  return out;
}

/// The text of look_up_group, a map a lane.
LC_LANES_FN void look_up_group_lanes(const FlatReceivers& receivers, const GroupMap* maps, int first, int count,
                                     int size, float* share) {
  const float* record[Lanes::kCount];
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    record[lane] = reinterpret_cast<const float*>(maps[first + (lane < count ? lane : 0)].record);
  }
  const FourBatches p = load_block(record, 0), q = load_block(record, 1), r = load_block(record, 2),
                    s = load_block(record, 3);
  const LanesVec3 origin{p.a, p.b, p.c}, x{q.a, q.b, q.c}, y{r.a, r.b, r.c}, z{s.a, s.b, s.c};
  const Lanes steps = p.d, bias_steps = q.d;
  const auto to_map = [&](LanesVec3 v) { return LanesVec3{dot(v, x), dot(v, y), dot(v, z)}; };
  const LanesVec3 local = to_map(broadcast(receivers.middle) - origin), a = to_map(broadcast(receivers.half_a)),
                  b = to_map(broadcast(receivers.half_b)), normal = to_map(broadcast(receivers.ng));

  const Lanes zero(0.0f), one(1.0f), texel(2.0f / static_cast<float>(size)), half(0.5f * static_cast<float>(size));
  const Lanes height = absolute(a.z) + absolute(b.z), reach(receivers.reach);
  const Lanes distance_sq = max_of(dot(local, local), Lanes(1e-30f));
  const Lanes inverse = quick_inverse_root(distance_sq), distance = distance_sq * inverse;
  const Lanes near = reach * inverse, off = Lanes(receivers.off) * inverse;
  const Mask behind = local.z + Lanes(1.01f) * height < zero;

  // Where the receivers lie on the map.
  const Lanes sum = max_of(distance + local.z, Lanes(1e-30f)), scale = quick_reciprocal(sum);
  const Lanes u = local.x * scale, v = local.y * scale;
  const Lanes away_a = dot(a, local) * inverse, away_b = dot(b, local) * inverse;
  const Lanes angle = near * (one + Lanes(1.4f) * near), bend = Lanes(1.25f) * angle * angle;
  const Lanes grow_a = away_a + a.z, grow_b = away_b + b.z;
  const Lanes reach_u = (absolute(a.x - u * grow_a) + absolute(b.x - u * grow_b)) * scale + bend;
  const Lanes reach_v = (absolute(a.y - v * grow_a) + absolute(b.y - v * grow_b)) * scale + bend;
  const Lanes place_x = u * half + (half - Lanes(0.5f)), place_y = v * half + (half - Lanes(0.5f));
  const Lanes slack_x = reach_u * half + Lanes(1e-3f), slack_y = reach_v * half + Lanes(1e-3f), mid(0.5f);
  const Lanes x_least = place_x - slack_x, x_most = place_x + slack_x;
  const Lanes y_least = place_y - slack_y, y_most = place_y + slack_y;
  const Lanes x_lo = floor_of(x_least), x_hi = floor_of(x_most) + one;
  const Lanes y_lo = floor_of(y_least), y_hi = floor_of(y_most) + one;
  const Lanes last(static_cast<float>(size - 3) + 0.5f);
  const Lanes wide = x_hi - x_lo, tall = y_hi - y_lo;
  const Lanes facing = dot(local, normal) * inverse;
  const Mask seen_flat = (off < Lanes(kFlatnessSeen)) & (absolute(facing) > Lanes(kLeastFacingOfGroup));
  const Mask fits = seen_flat & (near < Lanes(0.2f)) & (local.z - Lanes(1.01f) * height > zero) & (x_lo > -mid) &
                    (x_lo < last) & (y_lo > -mid) & (y_lo < last) & (wide < Lanes(2.5f)) & (tall < Lanes(2.5f));
  const std::uint32_t asking = bits(fits);
  Lanes found(kEachItsOwn);
  if (asking != 0) {
    // How far the receivers' comparisons differ from the middle's.
    const Lanes slope = (texel * sum) * (inverse * inverse_facing(facing));
    const Lanes minus_along = -facing - normal.z;
    const Lanes change_x = slope * (u * minus_along + normal.x), change_y = slope * (v * minus_along + normal.y);
    const Lanes start = change_x * (x_lo - place_x) + (change_y * (y_lo - place_y) + one);
    const Lanes wander = reach_u + reach_v;
    const Lanes room = (Lanes(4.2f) * (Lanes(1.2f) * texel + wander) * wander + Lanes(2.0f) * off + Lanes(1e-5f)) *
                       quick_reciprocal(max_of(absolute(facing), Lanes(kLeastFacing)));
    const Lanes away = absolute(away_a) + absolute(away_b);
    const Lanes nearer = away * inverse + near * near;
    const Lanes least = one - nearer, most = one + Lanes(1.4f) * nearer;
    const Lanes bias = sum * bias_steps + one;
    const Lanes other_bias = (away + height + Lanes(2.0f) * reach * near) * bias_steps + Lanes(0.51f);
    const Lanes depth = distance * steps, high_depth = depth * Lanes(1 + 1e-5f), low_depth = depth * Lanes(1 - 1e-5f);

    const Lanes index = select(fits, y_lo * Lanes(static_cast<float>(size)) + x_lo, zero);
    const GroupCodes codes = load_codes(maps, first, count, index, size);
    // Texels that no receiver asks: beyond the span, or neither in the column nor in the row of one's own texel.
    std::uint32_t past_x[3], past_y[3], off_x[3], off_y[3];
    const auto outside = [&](Lanes at, Lanes from, Lanes to) {
      return bits((at < floor_of(from + mid) - mid) | (at > floor_of(to + mid) + mid));
    };
    for (int i = 0; i < 3; ++i) {
      const Lanes step(static_cast<float>(i));
      past_x[i] = bits(wide < step - mid);
      past_y[i] = bits(tall < step - mid);
      off_x[i] = outside(x_lo + step, x_least, x_most);
      off_y[i] = outside(y_lo + step, y_least, y_most);
    }
    std::uint32_t pass = asking, fail = asking;
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t not_asked = past_x[i] | past_y[j] | (off_x[i] & off_y[j]);
        const Lanes code = codes.at[j][i] + bias;
        const Lanes e = start + Lanes(static_cast<float>(i)) * change_x + Lanes(static_cast<float>(j)) * change_y;
        pass &= not_asked | ~bits((code - other_bias) * max_of(e - room, least) < high_depth);
        fail &= not_asked | bits((code + other_bias) * max_of(e + room, most) < low_depth);
      }
    }
    found = select(Mask{lanes_of(pass)}, one, select(Mask{lanes_of(fail)}, zero, found));
  }
  found = select(behind & (near < Lanes(0.2f)) & (off < Lanes(kFlatnessSeen)), zero, found);
  found.store(share + first);
}

void look_up_group(const FlatReceivers& receivers, const GroupMap* maps, int count, int size, float* share) {
  for (int first = 0; first < count; first += Lanes::kCount) {
    look_up_group_lanes(receivers, maps, first, count - first, size, share);
  }
}

}  // namespace
}  // namespace lightcuts::LC_ISA
