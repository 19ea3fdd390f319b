// How shadow maps are drawn and encoded: part of ism_kernels_body.h.
// No include guard on purpose.

namespace lightcuts::LC_ISA {
namespace {

/// A register of points as a map draws them, one a lane.
struct alignas(64) ProjectedPoints {
  float x[Lanes::kCount], y[Lanes::kCount], z[Lanes::kCount];  // twice the centre (orthographic: once)
  float normal_x[Lanes::kCount], normal_y[Lanes::kCount], normal_z[Lanes::kCount];  // of MapDisc (orthographic: unit)
  float slack[Lanes::kCount];                                                       // of MapDisc (orthographic: plane)
  float column_lo[Lanes::kCount], column_hi[Lanes::kCount];  // texels whose centres the footprint may hold: [lo, hi)
  float row_lo[Lanes::kCount], row_hi[Lanes::kCount];
};

/// First texel whose centre lies past a coordinate given in texels.
LC_LANES_FN Lanes texel_from(Lanes at, Lanes end) {
  // Truncation of what is not negative is the floor.
  return xsimd::trunc(min_of(max_of(at + Lanes(0.5f), Lanes(0.0f)), end).value);
}

/// Boxes on the map, their sides in [-1, 1] coordinates.
struct LanesBox {
  Lanes lo_u, hi_u, lo_v, hi_v;
};
LC_LANES_FN LanesBox box_of(Footprint<Lanes> print) {
  return {print.u - print.radius, print.u + print.radius, print.v - print.radius, print.v + print.radius};
}
LC_LANES_FN LanesBox box_of(MapBox<Lanes> box) {
  return {box.u - box.half_u, box.u + box.half_u, box.v - box.half_v, box.v + box.half_v};
}

/// What discs of one radius may cover; `seen`: the lanes that matter.
template <bool Paraboloid>
LC_LANES_FN LanesBox boxes(LanesVec3 local, LanesVec3 normal, Lanes distance_sq, std::uint32_t seen,
                           const MapView& view, float radius) {
  if constexpr (!Paraboloid) return box_of(orthographic_footprint(local, radius, view.half_width));
  const Lanes least(radius / kSmallDisc);
  const Mask small = (distance_sq > least * least) & (local.z > Lanes(0.0f));
  const LanesBox own = box_of(paraboloid_box(local, normal, square_root(distance_sq), Lanes(radius)));
  if ((seen & ~bits(small)) == 0) return own;
  const LanesBox whole = box_of(paraboloid_footprint(local, radius));
  return {select(small, own.lo_u, whole.lo_u), select(small, own.hi_u, whole.hi_u), select(small, own.lo_v, whole.lo_v),
          select(small, own.hi_v, whole.hi_v)};
}

/// Stores the texels within boxes; returns the lanes that hold any.
LC_LANES_FN std::uint32_t store_texels(const LanesBox& box, int size, ProjectedPoints& out) {
  const Lanes one(1.0f), half(0.5f * static_cast<float>(size)), end(static_cast<float>(size));
  const Lanes column_lo = texel_from((box.lo_u + one) * half, end),
              column_hi = texel_from((box.hi_u + one) * half, end);
  const Lanes row_lo = texel_from((box.lo_v + one) * half, end), row_hi = texel_from((box.hi_v + one) * half, end);
  column_lo.store(out.column_lo);
  column_hi.store(out.column_hi);
  row_lo.store(out.row_lo);
  row_hi.store(out.row_hi);
  return bits((column_lo < column_hi) & (row_lo < row_hi));
}

LC_LANES_FN void store(LanesVec3 v, float* x, float* y, float* z) {
  v.x.store(x);
  v.y.store(y);
  v.z.store(z);
}

/// Brings points into the view's coordinates; returns the lanes that the map can see.
template <bool Paraboloid>
LC_LANES_FN std::uint32_t project(const PointArrays& points, std::size_t first, const MapView& view, float radius,
                                  int size, ProjectedPoints& out) {
  LanesVec3 local = to_local_point(view, load_unaligned(points.x, points.y, points.z, first));
  Lanes distance_sq = dot(local, local);
  Mask seen = local.z > Lanes(0.0f);
  if constexpr (Paraboloid) {
    // Discs reach a little higher than their points; a point below the horizon is left out as a whole.
    seen = seen & (local.z * local.z > Lanes(kLeastCosine * kLeastCosine) * distance_sq);
    // Where texels beyond the rim are drawn (point lights), discs of points beyond it serve them.
    if (view.rim_sq > 1) seen = local.z > Lanes(-radius);
  }
  std::uint32_t lanes = bits(seen);
  if (lanes == 0) return 0;

  const LanesVec3 normal =
      to_local_vector(view.frame, load_unaligned(points.normal_x, points.normal_y, points.normal_z, first));
  Lanes plane = dot(local, normal);
  const Lanes deeper = select(plane < Lanes(0.0f), load_unaligned(points.sink_in_front + first),
                              load_unaligned(points.sink_behind + first));
  local = local + normal * deeper;
  plane = plane + deeper;
  distance_sq = dot(local, local);
  lanes &= store_texels(boxes<Paraboloid>(local, normal, distance_sq, lanes, view, radius), size, out);
  if (lanes == 0) return 0;
  if constexpr (Paraboloid) {
    lanes &= bits(plane * plane > Lanes(kLeastPlane * kLeastPlane) * distance_sq);
    const MapDisc<Lanes> disc = map_disc(local, normal, plane, Lanes(radius * radius));
    store(disc.twice_centre, out.x, out.y, out.z);
    store(disc.normal, out.normal_x, out.normal_y, out.normal_z);
    disc.slack.store(out.slack);
  } else {
    store(local, out.x, out.y, out.z);
    store(normal, out.normal_x, out.normal_y, out.normal_z);
    plane.store(out.slack);
  }
  return lanes;
}

/// The edges of a shape that come near one of its discs, in a view's coordinates. Only the first `count` are set.
struct NearEdges {
  float x[kDiscEdges], y[kDiscEdges], z[kDiscEdges];
  float offset[kDiscEdges];
};

LC_LANES_FN int near_edges(const DiscShape& shape, Vec3 centre, const MapView& view, NearEdges& edges) {
  int count = 0;
  for (int i = 0; i < kDiscEdges; ++i) {
    if (dot(shape.inward[i], centre) - shape.offset[i] >= shape.radius) continue;
    const Vec3 inward = to_local_vector(view.frame, shape.inward[i]);
    edges.x[count] = inward.x;
    edges.y[count] = inward.y;
    edges.z[count] = inward.z;
    edges.offset[count++] = shape.offset[i] - dot(shape.inward[i], view.origin);
  }
  return count;
}

LC_LANES_FN Lanes register_at(const float* from) { return Batch::load_aligned(from); }

/// What the discs of a map share.
struct Canvas {
  const MapView& view;
  int size;
  std::size_t stride;
  float texel;  ///< width of one in [-1, 1] coordinates
  float* nearness;
};

alignas(64) constexpr float kCounting[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

/// Coordinates of the columns of a register whose first texel is `i`.
LC_LANES_FN Lanes columns_from(int i, float texel) {
  return Lanes(static_cast<float>(i) * texel + (0.5f * texel - 1)) + Lanes::load(kCounting) * Lanes(texel);
}

/// One disc, cut by up to `Edges` edges, in registers.
template <bool Paraboloid, int Edges>
struct LanesDisc {
  MapDisc<Lanes> disc;
  static constexpr int kRoom = Edges + (Edges == 0 ? 1 : 0);
  LanesVec3 edge[kRoom];
  Lanes offset[kRoom];  // orthographic
  int edge_count = Edges;
  Lanes radius_sq, half_width, far;  // orthographic

  LC_LANES_FN void draw_row(Lanes u, Lanes u_sq, Lanes v, float* at) const {
    Lanes found;
    Mask drawn;
    if constexpr (Paraboloid) {
      const TexelRay<Lanes> w = texel_ray(u, u_sq, v, v * v);
      const DiscTest<Lanes> test = test_disc(disc, w);
      drawn = test.outside < Lanes(0.0f);
      found = test.nearness;
      for (int e = 0; e < edge_count; ++e) drawn = drawn & (along(w, edge[e]) > Lanes(0.0f));
    } else {
      const LanesVec3 hit = meet_plane_orthographic(u, v, disc.normal, disc.slack, half_width);
      drawn = (length_sq(hit - disc.twice_centre) < radius_sq) & (hit.z > Lanes(0.0f));
      found = far - hit.z;
      for (int e = 0; e < edge_count; ++e) drawn = drawn & (dot(edge[e], hit) > offset[e]);
    }
    const Lanes before = register_at(at);
    // What lies behind the light is below 0, and so never larger.
    select(drawn, max_of(found, before), before).store(at);
  }
};

/// Draws the disc of one lane.
template <bool Paraboloid, int Edges>
LC_LANES_FN void draw_disc(const ProjectedPoints& points, int lane, const NearEdges& cut, int edge_count, float radius,
                           const Canvas& canvas) {
  LanesDisc<Paraboloid, Edges> disc;
  disc.disc = {broadcast({points.normal_x[lane], points.normal_y[lane], points.normal_z[lane]}),
               broadcast({points.x[lane], points.y[lane], points.z[lane]}), Lanes(points.slack[lane])};
  disc.edge_count = Edges < kDiscEdges ? Edges : edge_count;
  for (int e = 0; e < disc.edge_count; ++e) {
    disc.edge[e] = broadcast({cut.x[e], cut.y[e], cut.z[e]});
    disc.offset[e] = Lanes(cut.offset[e]);
    if (Paraboloid) disc.edge[e] = map_edge(disc.disc, disc.edge[e], disc.offset[e]);
  }
  if constexpr (!Paraboloid) {
    disc.radius_sq = Lanes(radius * radius);
    disc.half_width = Lanes(canvas.view.half_width);
    disc.far = Lanes(canvas.view.far);
  }

  const int column_hi = static_cast<int>(points.column_hi[lane]);
  const int row_lo = static_cast<int>(points.row_lo[lane]), row_hi = static_cast<int>(points.row_hi[lane]);
  const Lanes texel(canvas.texel), first_row(static_cast<float>(row_lo) * canvas.texel + (0.5f * canvas.texel - 1));
  for (int i = static_cast<int>(points.column_lo[lane]) & ~(Lanes::kCount - 1); i < column_hi; i += Lanes::kCount) {
    const Lanes u = columns_from(i, canvas.texel), u_sq = u * u;
    float* at = canvas.nearness + static_cast<std::size_t>(row_lo) * canvas.stride + static_cast<std::size_t>(i);
    Lanes v = first_row;
    // Two rows at a time: most discs have no more, so the processor foresees the branch. One row too many does no harm.
    for (int j = row_lo; j < row_hi; j += 2, at += 2 * canvas.stride) {
      const Lanes next = v + texel;
      disc.draw_row(u, u_sq, v, at);
      disc.draw_row(u, u_sq, next, at + canvas.stride);
      v = next + texel;
    }
  }
}

template <bool Paraboloid>
LC_LANES_FN void draw_points(const PointArrays& points, std::size_t first, std::size_t count, const MapView& view,
                             int size, float* nearness) {
  const float largest = points.shapes[0].radius;
  const Canvas canvas{view, size, nearness_stride(size), 2.0f / static_cast<float>(size), nearness};
  ProjectedPoints projected;
  NearEdges cut;
  const std::size_t end = first + count;
  for (std::size_t at = first; at < end; at += static_cast<std::size_t>(Lanes::kCount)) {
    std::uint32_t lanes = project<Paraboloid>(points, at, view, largest, size, projected);
    if (end - at < static_cast<std::size_t>(Lanes::kCount)) lanes &= (1u << (end - at)) - 1u;
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      const std::size_t point = at + static_cast<std::size_t>(lane);
      const DiscShape& shape = points.shapes[points.shape[point]];
      if (Paraboloid && shape.radius != largest) {
        projected.slack[lane] += largest * largest - shape.radius * shape.radius;
      }
      int edges = 0;
      if (points.shape[point] > 1) {
        edges = near_edges(shape, {points.x[point], points.y[point], points.z[point]}, view, cut);
      }
      switch (edges) {
        case 0:
          draw_disc<Paraboloid, 0>(projected, lane, cut, edges, shape.radius, canvas);
          break;
        case 1:
          draw_disc<Paraboloid, 1>(projected, lane, cut, edges, shape.radius, canvas);
          break;
        default:
          draw_disc<Paraboloid, kDiscEdges>(projected, lane, cut, edges, shape.radius, canvas);
      }
    }
  }
}

void draw(const PointArrays& points, std::size_t first, std::size_t count, const MapView& view, int size,
          float* nearness) {
  if (view.half_width == 0) {
    draw_points<true>(points, first, count, view, size, nearness);
  } else {
    draw_points<false>(points, first, count, view, size, nearness);
  }
}

/// A register of codes as floats, from 0 to kDepthSteps; -1 where nothing was drawn.
template <class Depth>
LC_LANES_FN Lanes code_of(Lanes nearness, Lanes u, float v, const MapView& view, float steps_per_metre) {
  const Lanes rho_sq = u * u + Lanes(v * v);
  const Lanes depth =
      view.half_width == 0 ? depth_of_nearness(nearness, Lanes(1.0f) + rho_sq) : Lanes(view.far) - nearness;
  const Lanes code = min_of(depth * Lanes(steps_per_metre) + Lanes(0.5f), Lanes(kDepthSteps<Depth>));
  return select((nearness > Lanes(0.0f)) & (rho_sq < Lanes(view.rim_sq)), code, Lanes(-1.0f));
}

template <class Depth>
LC_LANES_FN void encode(const float* nearness, const MapView& view, int size, Depth* codes) {
  alignas(64) float row[Lanes::kCount];
  const float texel = 2.0f / static_cast<float>(size),
              steps = kDepthSteps<Depth> / (view.far > 1e-30f ? view.far : 1e-30f);
  for (int j = 0; j < size; ++j) {
    const float* from = nearness + static_cast<std::size_t>(j) * nearness_stride(size);
    for (int i = 0; i < size; i += Lanes::kCount) {
      const Lanes u = columns_from(i, texel);
      code_of<Depth>(register_at(from + i), u, texel_centre(j, size), view, steps).store(row);
      const int count = size - i < Lanes::kCount ? size - i : Lanes::kCount;
      // -1 becomes kNoDepth.
      for (int k = 0; k < count; ++k) codes[k] = static_cast<Depth>(static_cast<std::int32_t>(row[k]));
      codes += count;
    }
  }
}
void encode16(const float* nearness, const MapView& view, int size, std::uint16_t* codes) {
  encode(nearness, view, size, codes);
}
void encode32(const float* nearness, const MapView& view, int size, std::uint32_t* codes) {
  encode(nearness, view, size, codes);
}

}  // namespace
}  // namespace lightcuts::LC_ISA
