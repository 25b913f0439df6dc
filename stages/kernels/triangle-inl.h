// Fetches the world-space vertices of any triangle of the scene, one triangle per lane.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_TRIANGLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_TRIANGLE_INL_H_
#undef CARPOOL_STAGES_KERNELS_TRIANGLE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_TRIANGLE_INL_H_
#endif

#include <cstddef>

#include "stages/simd/lanes-inl.h"
#include "stages/simd/quads-inl.h"
#include "stages/tables/geometry_view.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// World space, relative to `SceneTables::origin`; in the order of the index stream.
template <class D>
struct Triangle {
  Vec3<D> p0, p1, p2;
  Mask<D> mirrored;  // the placement's transform turns the winding over
};

/// One placement per lane: its integers, and the record that its transforms are read from.
template <class D>
struct PlacementLanes {
  Records<Placement, D> record;
  Int<D> first_index, first_vertex, flags, material;
  Int<D> tangents, colors, uv_sets, more_uvs;
};

/// `index` must be valid in every lane.
template <class D>
HWY_INLINE PlacementLanes<D> LoadPlacements(D d, const Placement* base, Int<D> index) {
  const Records<Placement, D> record = MakeRecords(d, base, index);
  if (hn::MaxLanes(D()) < 4 || record.same != nullptr) {
    const auto field = [&](size_t offset) HWY_ATTR { return FieldInt(d, record, offset); };
    return {record,
            field(offsetof(Placement, first_index)),
            field(offsetof(Placement, first_vertex)),
            field(offsetof(Placement, flags)),
            field(offsetof(Placement, material)),
            field(offsetof(Placement, tangents)),
            field(offsetof(Placement, colors)),
            field(offsetof(Placement, uv_sets)),
            field(offsetof(Placement, more_uvs))};
  }
  const IntQuad<D> a = FieldIntQuad(d, base, index, offsetof(Placement, first_index));
  const IntQuad<D> b = FieldIntQuad(d, base, index, offsetof(Placement, tangents));
  return {record, a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w};
}
static_assert(offsetof(Placement, material) == offsetof(Placement, first_index) + 12 &&
              offsetof(Placement, tangents) == offsetof(Placement, first_index) + 16 &&
              offsetof(Placement, more_uvs) == offsetof(Placement, tangents) + 12);

template <class D>
HWY_INLINE Mask<D> PlacementHas(D d, const PlacementLanes<D>& placement, int32_t flag) {
  return hn::RebindMask(d, hn::TestBit(placement.flags, hn::Set(IntTag<D>(), flag)));
}

/// Vertex numbers (within the shape) of triangle `primitive` of `placement`.
template <class D>
struct TriangleIndices {
  Int<D> i0, i1, i2;
};

template <class D>
HWY_INLINE TriangleIndices<D> GatherTriangleIndices(D d, const GeometryView& view,
                                                    const PlacementLanes<D>& placement,
                                                    Int<D> primitive) {
  const Int<D> first = placement.first_index + primitive * hn::Set(IntTag<D>(), 3);
  const IntQuad<D> q = GatherIntQuad(d, view.indices, first);  // one more than there are: padded
  return {q.x, q.y, q.z};
}

/// Where the floats of vertex `i` of the placement's shape begin.
template <class D>
HWY_INLINE Int<D> VertexWord(D, const PlacementLanes<D>& placement, Int<D> i) {
  return hn::ShiftLeft<3>(placement.first_vertex + i);
}
inline const float* VertexWords(const GeometryView& view) {
  return reinterpret_cast<const float*>(view.vertices);
}

/// A vertex of each lane, in the space of its shape.
template <class D>
struct VertexLanes {
  Vec3<D> position, normal;
  Vec2<D> uv;
};
template <class D>
HWY_INLINE VertexLanes<D> GatherVertex(D d, const GeometryView& view,
                                       const PlacementLanes<D>& placement, Int<D> i) {
  const Oct<D> v = GatherOct(d, VertexWords(view), VertexWord(d, placement, i));
  return {{v.low.x, v.low.y, v.low.z}, {v.low.w, v.high.x, v.high.y}, {v.high.z, v.high.w}};
}
template <class D>
HWY_INLINE Vec3<D> GatherPosition(D d, const GeometryView& view, const PlacementLanes<D>& placement,
                                  Int<D> i) {
  return GatherTriple(d, VertexWords(view), VertexWord(d, placement, i));
}
/// For readers of nothing else.
template <class D>
HWY_INLINE VertexLanes<D> GatherBareVertex(D d, const GeometryView& view,
                                           const PlacementLanes<D>& placement, Int<D> i) {
  const Real<D> zero = hn::Zero(d);
  return {GatherPosition(d, view, placement, i), {zero, zero, zero}, {zero, zero}};
}
template <class D>
HWY_INLINE Vec2<D> GatherFirstUv(D d, const GeometryView& view, const PlacementLanes<D>& placement,
                                 Int<D> i) {
  const Quad<D> rest = GatherQuad(d, VertexWords(view) + 4, VertexWord(d, placement, i));
  return {rest.z, rest.w};
}
static_assert(sizeof(MeshVertex) == 32 && offsetof(MeshVertex, uv) == 24);

/// The rows of a 3x4 matrix.
template <class D>
struct Affine {
  Quad<D> rows[3];
};
template <class D>
HWY_INLINE Affine<D> ObjectToWorld(D d, const GeometryView& view, Int<D> placement) {
  const auto row = [&](size_t i) HWY_ATTR {
    return FieldQuad(d, view.placements, placement, offsetof(Placement, object_to_world) + 16 * i);
  };
  return {{row(0), row(1), row(2)}};
}
template <class D>
HWY_INLINE Vec3<D> TransformPoint(const Affine<D>& m, const Vec3<D>& p) {
  const auto row = [&](const Quad<D>& r) HWY_ATTR { return Dot(Vec3<D>{r.x, r.y, r.z}, p) + r.w; };
  return {row(m.rows[0]), row(m.rows[1]), row(m.rows[2])};
}

/// The triangle of these vertices, from the space of its shape.
template <class D>
HWY_INLINE Triangle<D> TriangleToWorld(D d, const GeometryView& view,
                                       const PlacementLanes<D>& placement, Vec3<D> p0, Vec3<D> p1,
                                       Vec3<D> p2) {
  const Mask<D> instanced = PlacementHas(d, placement, kPlacementInstanced);
  if (!hn::AllFalse(d, instanced)) {
    // Flat lanes keep their vertices: going through an identity would cost them a rounding of -0.
    const Affine<D> to_world = ObjectToWorld(d, view, placement.record.index);
    p0 = Select<D>(instanced, TransformPoint<D>(to_world, p0), p0);
    p1 = Select<D>(instanced, TransformPoint<D>(to_world, p1), p1);
    p2 = Select<D>(instanced, TransformPoint<D>(to_world, p2), p2);
  }
  return {p0, p1, p2, PlacementHas(d, placement, kPlacementMirrored)};
}

/// The triangle's vertices in world space. Every lane needs a valid placement and primitive.
template <class D>
HWY_INLINE Triangle<D> TriangleVertices(D d, const GeometryView& view, Int<D> placement,
                                        Int<D> primitive) {
  const PlacementLanes<D> lanes = LoadPlacements(d, view.placements, placement);
  const TriangleIndices<D> index = GatherTriangleIndices(d, view, lanes, primitive);
  return TriangleToWorld(d, view, lanes, GatherPosition(d, view, lanes, index.i0),
                         GatherPosition(d, view, lanes, index.i1),
                         GatherPosition(d, view, lanes, index.i2));
}

/// Twice the triangle's area times its geometric normal, on the side that glTF calls the front.
template <class D>
HWY_INLINE Vec3<D> TriangleAreaNormal(const Triangle<D>& t) {
  const Vec3<D> n = Cross<D>(Sub<D>(t.p1, t.p0), Sub<D>(t.p2, t.p0));
  return Select<D>(t.mirrored, Neg<D>(n), n);
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
