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

/// Vertex numbers (within the shape) of triangle `primitive` of `placement`.
template <class D>
struct TriangleIndices {
  Int<D> i0, i1, i2;
};

template <class D>
HWY_INLINE TriangleIndices<D> GatherTriangleIndices(D d, const GeometryView& view,
                                                    const Records<Placement, D>& placement,
                                                    Int<D> primitive) {
  const IntTag<D> di;
  const Int<D> first =
      FieldInt(d, placement, offsetof(Placement, first_index)) + primitive * hn::Set(di, 3);
  if constexpr (hn::MaxLanes(D()) < 4) {
    return {GatherInt(d, view.indices, first), GatherInt(d, view.indices, first + hn::Set(di, 1)),
            GatherInt(d, view.indices, first + hn::Set(di, 2))};
  } else {
    // As the bits of floats, which only travel.
    const Vec3<D> bits = GatherTriple(d, reinterpret_cast<const float*>(view.indices), first);
    return {hn::BitCast(di, bits.x), hn::BitCast(di, bits.y), hn::BitCast(di, bits.z)};
  }
}

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

/// The triangle's vertices in world space. Every lane needs a valid placement and primitive.
template <class D>
HWY_INLINE Triangle<D> TriangleVertices(D d, const GeometryView& view,
                                        const Records<Placement, D>& placement,
                                        const TriangleIndices<D>& index) {
  const IntTag<D> di;
  const Int<D> base = FieldInt(d, placement, offsetof(Placement, positions));
  const auto vertex = [&](Int<D> i) HWY_ATTR {
    return GatherTriple(d, view.floats, base + i * hn::Set(di, 3));
  };
  Vec3<D> p0 = vertex(index.i0), p1 = vertex(index.i1), p2 = vertex(index.i2);

  const Int<D> flags = FieldInt(d, placement, offsetof(Placement, flags));
  const auto has = [&](int32_t flag) HWY_ATTR {
    return hn::RebindMask(d, hn::TestBit(flags, hn::Set(di, flag)));
  };
  const Mask<D> instanced = has(kPlacementInstanced);
  if (!hn::AllFalse(d, instanced)) {
    // Flat lanes keep their vertices: going through an identity would cost them a rounding of -0.
    const Affine<D> to_world = ObjectToWorld(d, view, placement.index);
    p0 = Select<D>(instanced, TransformPoint<D>(to_world, p0), p0);
    p1 = Select<D>(instanced, TransformPoint<D>(to_world, p1), p1);
    p2 = Select<D>(instanced, TransformPoint<D>(to_world, p2), p2);
  }
  return {p0, p1, p2, has(kPlacementMirrored)};
}

template <class D>
HWY_INLINE Triangle<D> TriangleVertices(D d, const GeometryView& view, Int<D> placement,
                                        Int<D> primitive) {
  const Records<Placement, D> record = MakeRecords(d, view.placements, placement);
  return TriangleVertices(d, view, record, GatherTriangleIndices(d, view, record, primitive));
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
