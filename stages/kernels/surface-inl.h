// What a ray hit: position with its error bound, normals, texture coordinates and footprint,
// material values.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_SURFACE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_SURFACE_INL_H_
#undef CARPOOL_STAGES_KERNELS_SURFACE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_SURFACE_INL_H_
#endif

#include <algorithm>
#include <iterator>

#include "stages/kernels/kernels.h"
#include "stages/kernels/texture-inl.h"
#include "stages/kernels/triangle-inl.h"
#include "stages/mutants.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// A point on a triangle, by barycentrics of its vertices, as far as reading textures needs it.
template <class D>
struct TexturePoint {
  Records<Material, D> material;
  Int<D> uv_sets, more_uvs;  // of the placement
  TriangleIndices<D> index;
  Real<D> b0, b1, b2;
};
/// The same of the scene.
template <class D>
struct SurfacePoint : TexturePoint<D> {
  PlacementLanes<D> placement;
};

template <class D>
HWY_INLINE SurfacePoint<D> MakeSurfacePoint(D d, const KernelContext& c, Int<D> placement,
                                            Int<D> primitive, Real<D> b1, Real<D> b2) {
  const Real<D> b0 = hn::Max(Splat(d, 1) - b1 - b2, hn::Zero(d));
  const PlacementLanes<D> lanes = LoadPlacements(d, c.geometry.placements, placement);
  return {{MakeRecords(d, c.materials, lanes.material), lanes.uv_sets, lanes.more_uvs,
           GatherTriangleIndices(d, c.geometry, lanes, primitive), b0, b1, b2},
          lanes};
}

/// The shape of the surface at a hit. Normals face the side that the ray came from.
template <class D>
struct Surface {
  Vec3<D> position;   // recomputed from barycentrics
  Vec3<D> error;      // componentwise bound on its distance to the triangle that Embree sees
  Vec3<D> geometric;  // unit normal of the triangle
  Vec3<D> shading;    // interpolated, unit
  Real<D> twice_area;
  Mask<D> back;  // the ray hit the side that glTF calls the back
};

/// The value at the point of what the vertices have.
template <class D>
HWY_INLINE Real<D> Interpolate(const TexturePoint<D>& at, Real<D> v0, Real<D> v1, Real<D> v2) {
  return hn::MulAdd(at.b0, v0, hn::MulAdd(at.b1, v1, at.b2 * v2));
}
template <class D>
HWY_INLINE Vec3<D> Interpolate(const TexturePoint<D>& at, const Vec3<D>& v0, const Vec3<D>& v1,
                               const Vec3<D>& v2) {
  return {Interpolate<D>(at, v0.x, v1.x, v2.x), Interpolate<D>(at, v0.y, v1.y, v2.y),
          Interpolate<D>(at, v0.z, v1.z, v2.z)};
}

template <class D>
HWY_INLINE Mask<D> IsPresent(D d, Int<D> offset) {
  return hn::RebindMask(d, hn::Gt(offset, hn::Set(IntTag<D>(), kNone)));
}

/// Normals of object space to world space, unnormalised; outward stays outward under mirroring.
template <class D>
HWY_INLINE Vec3<D> NormalToWorld(D d, const Records<Placement, D>& placement, const Vec3<D>& n) {
  const auto row = [&](size_t i) HWY_ATTR {
    return Dot(FieldTriple(d, placement, offsetof(Placement, normal_to_world) + 12 * i), n);
  };
  return {row(0), row(1), row(2)};
}

template <class D>
HWY_INLINE Vec3<D> VectorToWorld(D d, const Records<Placement, D>& placement, const Vec3<D>& v) {
  const auto row = [&](size_t i) HWY_ATTR {
    return Dot(FieldTriple(d, placement, offsetof(Placement, object_to_world) + 16 * i), v);
  };
  return {row(0), row(1), row(2)};
}

template <class D>
HWY_INLINE Vec3<D> MaxAbs3(const Triangle<D>& t) {
  const auto most = [](Real<D> a, Real<D> b, Real<D> c)
                        HWY_ATTR { return hn::Max(hn::Abs(a), hn::Max(hn::Abs(b), hn::Abs(c))); };
  return {most(t.p0.x, t.p1.x, t.p2.x), most(t.p0.y, t.p1.y, t.p2.y), most(t.p0.z, t.p1.z, t.p2.z)};
}

/// Bound on how far the recomputed position, and Embree's own idea of the plane, may be off. Flat
/// triangles: interpolation errs by gamma(5) and the intersector's differences to the ray origin by
/// a few more ulps of the largest vertex coordinate, not of the hit's (vertices may be far from
/// it). Instanced ones add the transforms of vertices, origin and direction, relative to |M||p| +
/// |t|.
template <class D>
HWY_INLINE Vec3<D> PositionError(D d, const Records<Placement, D>& placement, Mask<D> instanced,
                                 const Triangle<D>& t) {
  constexpr double kUlp = 0x1p-24;
  Vec3<D> error = Scale(MaxAbs3(t), Splat(d, 10 * kUlp));
  if (!hn::AllFalse(d, instanced)) {
    const auto row = [&](size_t i) HWY_ATTR {
      const size_t at = offsetof(Placement, object_to_world) + 16 * i + 12;
      return hn::Abs(FieldReal(d, placement, at));
    };
    const Vec3<D> translation = {row(0), row(1), row(2)};
    const Real<D> largest = hn::Max(MaxComponent(translation), MaxComponent(MaxAbs3(t)));
    const Real<D> more = largest * Splat(d, 32 * kUlp);
    const Vec3<D> wider = Add<D>(error, {more, more, more});
    error = Select<D>(instanced, wider, error);
  }
  return error;
}

/// False only if no lane's material has a texture, or if all are opaque: of a batch of one material
/// that is known from its record.
template <class D>
HWY_INLINE bool MayHaveTextures(const Records<Material, D>& material) {
  if (material.same == nullptr) return true;
  return std::any_of(std::begin(material.same->slots), std::end(material.same->slots),
                     [](int32_t slot) { return slot != kNone; });
}
template <class D>
HWY_INLINE bool MayBeTransparent(const Records<Material, D>& material) {
  return material.same == nullptr || material.same->alpha_mode != AlphaMode::opaque;
}

/// The vertices of the triangle at the point, in the space of its shape.
template <class D>
struct Corners {
  VertexLanes<D> v0, v1, v2;
};
template <class D>
HWY_INLINE Corners<D> GatherCorners(D d, const KernelContext& c, const SurfacePoint<D>& at) {
  const Mask<D> smooth = PlacementHas(d, at.placement, kPlacementSmooth);
  const bool bare = hn::AllFalse(d, smooth) && !MayHaveTextures(at.material);
  const auto vertex = [&](Int<D> i) HWY_ATTR {
    return bare ? GatherBareVertex(d, c.geometry, at.placement, i)
                : GatherVertex(d, c.geometry, at.placement, i);
  };
  return {vertex(at.index.i0), vertex(at.index.i1), vertex(at.index.i2)};
}

/// `t` is the triangle of the corners, in world space.
template <class D>
HWY_INLINE Surface<D> MakeSurface(D d, const SurfacePoint<D>& at, const Corners<D>& corners,
                                  const Triangle<D>& t, const Vec3<D>& ray_direction) {
  const Mask<D> instanced = PlacementHas(d, at.placement, kPlacementInstanced);
  Surface<D> s;
  s.position = MulAdd(t.p1, at.b1, MulAdd(t.p2, at.b2, Scale(t.p0, at.b0)));
  s.error = PositionError(d, at.placement.record, instanced, t);

  const Vec3<D> toward = Neg<D>(ray_direction);
  const Vec3<D> area_normal = TriangleAreaNormal(t);
  s.twice_area = hn::Sqrt(Dot(area_normal, area_normal));
  const Vec3<D> front = SafeNormalize(d, area_normal, toward);  // zero area: facing the ray
  s.back = hn::Lt(Dot(front, toward), hn::Zero(d));
  s.geometric = Select<D>(s.back, Neg<D>(front), front);

  const Mask<D> smooth = PlacementHas(d, at.placement, kPlacementSmooth);
  s.shading = s.geometric;
  if (!hn::AllFalse(d, smooth)) {
    Vec3<D> n = Interpolate<D>(at, corners.v0.normal, corners.v1.normal, corners.v2.normal);
    if (!hn::AllFalse(d, instanced)) {
      n = Select<D>(instanced, NormalToWorld(d, at.placement.record, n), n);
    }
    n = SafeNormalize(d, n, front);
    n = Select<D>(s.back, Neg<D>(n), n);
    s.shading = Select<D>(smooth, n, s.geometric);
  }
  return s;
}

/// Coordinates of the first set; (0, 0) where the shape has none.
template <class D>
HWY_INLINE Vec2<D> InterpolateUv(const TexturePoint<D>& at, const Vec2<D>& v0, const Vec2<D>& v1,
                                 const Vec2<D>& v2) {
  return {Interpolate<D>(at, v0.x, v1.x, v2.x), Interpolate<D>(at, v0.y, v1.y, v2.y)};
}
template <class D>
HWY_INLINE Vec2<D> FirstCoordinates(D d, const KernelContext& c, const SurfacePoint<D>& at) {
  const auto vertex = [&](Int<D> i)
                          HWY_ATTR { return GatherFirstUv(d, c.geometry, at.placement, i); };
  return InterpolateUv<D>(at, vertex(at.index.i0), vertex(at.index.i1), vertex(at.index.i2));
}

/// Coordinates of the lanes' sets where those are not the first; (0, 0) where the shape has no such
/// set.
template <class D>
HWY_INLINE Vec2<D> FurtherCoordinates(D d, const KernelContext& c, const TexturePoint<D>& at,
                                      Int<D> set) {
  const IntTag<D> di;
  const Int<D> one = hn::Set(di, 1);
  const auto present = hn::And(hn::Gt(set, hn::Zero(di)), hn::Lt(set, at.uv_sets));
  if (hn::AllFalse(di, present)) return {hn::Zero(d), hn::Zero(d)};
  const auto vertex = [&](Int<D> i) HWY_ATTR {
    const Int<D> pair = i * (at.uv_sets - one) + (set - one);
    return GatherPair(d, c.geometry.floats,
                      hn::IfThenElseZero(present, at.more_uvs + hn::ShiftLeft<1>(pair)));
  };
  const Vec2<D> uv =
      InterpolateUv<D>(at, vertex(at.index.i0), vertex(at.index.i1), vertex(at.index.i2));
  const Mask<D> where = hn::RebindMask(d, present);
  return {hn::IfThenElseZero(where, uv.x), hn::IfThenElseZero(where, uv.y)};
}

/// Twice the triangle's area in texture coordinates of the first set.
template <class D>
HWY_INLINE Real<D> TwiceTextureArea(const Corners<D>& t) {
  const Vec2<D> a = {t.v1.uv.x - t.v0.uv.x, t.v1.uv.y - t.v0.uv.y};
  const Vec2<D> b = {t.v2.uv.x - t.v0.uv.x, t.v2.uv.y - t.v0.uv.y};
  return hn::Abs(DifferenceOfProducts(a.x, b.y, b.x, a.y));
}

/// Where textures are read: coordinates of the first set and what the ray cone covers there.
template <class D>
struct TextureFootprint {
  Vec2<D> uv;          // of set 0
  Real<D> log2_width;  // of the cone, in texture coordinates; very negative: finest level
  Real<D> u_level;     // chooses between neighbouring mip levels
};

/// Reads one texture slot of each lane's material; `absent` where the material has none.
template <class D>
HWY_INLINE Rgba<D> MaterialTexture(D d, const KernelContext& c, const TexturePoint<D>& at,
                                   const TextureFootprint<D>& footprint, Slot which, Mask<D> active,
                                   double absent) {
  const IntTag<D> di;
  const Real<D> fill = Splat(d, absent);
  const Rgba<D> none = {{fill, fill, fill}, fill};
  const Int<D> slot =
      FieldInt(d, at.material, offsetof(Material, slots) + 4 * static_cast<size_t>(which));
  active = hn::And(active, IsPresent(d, slot));
  if (hn::AllFalse(d, active)) return none;

  const Int<D> valid = hn::IfThenElseZero(hn::RebindMask(di, active), slot);
  const Int<D> set =
      hn::IfThenElseZero(hn::RebindMask(di, active),
                         FieldInt(d, c.textures.slots, valid, offsetof(TextureSlot, uv_set)));
  Vec2<D> uv = footprint.uv;
  const Mask<D> other_set = hn::RebindMask(d, hn::Gt(set, hn::Zero(di)));
  if (!hn::AllFalse(d, other_set)) {
    const Vec2<D> other = FurtherCoordinates(d, c, at, set);
    uv = {hn::IfThenElse(other_set, other.x, uv.x), hn::IfThenElse(other_set, other.y, uv.y)};
  }
  const Rgba<D> texel =
      SampleTexture(d, c.textures, valid, active, uv, footprint.log2_width, footprint.u_level);
  return {Select<D>(active, texel.rgb, none.rgb), hn::IfThenElse(active, texel.a, none.a)};
}

/// Vertex colour times factor times texture.
template <class D>
HWY_INLINE Rgba<D> BaseColor(D d, const KernelContext& c, const SurfacePoint<D>& at,
                             const TextureFootprint<D>& footprint, Mask<D> active) {
  const Vec3<D> factor = FieldTriple(d, at.material, offsetof(Material, base_color));
  const Real<D> alpha = FieldReal(d, at.material, offsetof(Material, base_color) + 12);
  const Rgba<D> texel = MaterialTexture(d, c, at, footprint, Slot::base_color, active, 1);
  Rgba<D> color = {Mul<D>(factor, texel.rgb), alpha * texel.a};

  const Int<D> colors = at.placement.colors;
  const Mask<D> colored = hn::And(active, IsPresent(d, colors));
  if (!hn::AllFalse(d, colored)) {
    const Int<D> base = hn::Max(colors, hn::Zero(IntTag<D>()));
    const auto vertex = [&](Int<D> i) HWY_ATTR {
      return GatherQuad(d, c.geometry.floats, base + hn::ShiftLeft<2>(i));
    };
    const Quad<D> q0 = vertex(at.index.i0), q1 = vertex(at.index.i1), q2 = vertex(at.index.i2);
    const auto channel = [&](Real<D> v0, Real<D> v1, Real<D> v2) HWY_ATTR {
      return hn::IfThenElse(colored, Interpolate<D>(at, v0, v1, v2), Splat(d, 1));
    };
    color.rgb = Mul<D>(color.rgb, {channel(q0.x, q1.x, q2.x), channel(q0.y, q1.y, q2.y),
                                   channel(q0.z, q1.z, q2.z)});
    color.a = color.a * channel(q0.w, q1.w, q2.w);
  }
  return color;
}

/// How much of the surface is there, by alphaMode: 1, a step at the cutoff, or alpha itself.
template <class D>
HWY_INLINE Real<D> Opacity(D d, const TexturePoint<D>& at, Real<D> alpha) {
  const IntTag<D> di;
  const Int<D> mode = FieldInt(d, at.material, offsetof(Material, alpha_mode));
  const auto is = [&](AlphaMode m) HWY_ATTR {
    return hn::RebindMask(d, hn::Eq(mode, hn::Set(di, static_cast<int32_t>(m))));
  };
  const Real<D> one = Splat(d, 1);
  const Real<D> cutoff = FieldReal(d, at.material, offsetof(Material, alpha_cutoff));
  const Real<D> step = hn::IfThenElseZero(hn::Ge(alpha, cutoff), one);
  const Real<D> clamped = hn::Min(hn::Max(alpha, hn::Zero(d)), one);
  return hn::IfThenElse(is(AlphaMode::mask), step,
                        hn::IfThenElse(is(AlphaMode::blend), clamped, one));
}

/// Emitted radiance at a point, always from the finest mip level: seen directly, reached by BSDF
/// sampling and by light sampling it is the same function, as MIS needs.
template <class D>
HWY_INLINE Vec3<D> EmittedRadiance(D d, const KernelContext& c, const TexturePoint<D>& at,
                                   const Vec2<D>& uv, Mask<D> active) {
  const TextureFootprint<D> finest = {uv, Splat(d, -100), hn::Zero(d)};
  const Rgba<D> texel = MaterialTexture(d, c, at, finest, Slot::emissive, active, 1);
  return Mul<D>(FieldTriple(d, at.material, offsetof(Material, emissive)), texel.rgb);
}

template <class D>
HWY_INLINE Mask<D> MaterialHas(D d, const Records<Material, D>& material, int32_t flag) {
  const Int<D> flags = FieldInt(d, material, offsetof(Material, flags));
  return hn::RebindMask(d, hn::TestBit(flags, hn::Set(IntTag<D>(), flag)));
}

/// The shading normal bent by the normal map, still facing the viewer's side of the triangle.
template <class D>
HWY_INLINE Vec3<D> MappedNormal(D d, const KernelContext& c, const SurfacePoint<D>& at,
                                const Surface<D>& s, const TextureFootprint<D>& footprint,
                                Mask<D> active) {
  const IntTag<D> di;
  const Int<D> tangents = at.placement.tangents;
  const Int<D> slot =
      FieldInt(d, at.material, offsetof(Material, slots) + 4 * static_cast<size_t>(Slot::normal));
  active = hn::And(active, hn::And(IsPresent(d, tangents), IsPresent(d, slot)));
  if (hn::AllFalse(d, active)) return s.shading;

  const Rgba<D> texel = MaterialTexture(d, c, at, footprint, Slot::normal, active, 0.5);
  const Real<D> scale = FieldReal(d, at.material, offsetof(Material, normal_scale));
  const auto expand = [&](Real<D> v) HWY_ATTR { return hn::MulSub(v, Splat(d, 2), Splat(d, 1)); };
  const Real<D> x = expand(texel.rgb.x) * scale, y = expand(texel.rgb.y) * scale;
  const Real<D> z = expand(texel.rgb.z);

  const Int<D> base = hn::Max(tangents, hn::Zero(di));
  const auto vertex = [&](Int<D> i) HWY_ATTR {
    return GatherQuad(d, c.geometry.floats, base + hn::ShiftLeft<2>(i));
  };
  const Quad<D> t0 = vertex(at.index.i0), t1 = vertex(at.index.i1), t2 = vertex(at.index.i2);
  Vec3<D> tangent = {Interpolate<D>(at, t0.x, t1.x, t2.x), Interpolate<D>(at, t0.y, t1.y, t2.y),
                     Interpolate<D>(at, t0.z, t1.z, t2.z)};
  Real<D> handedness = t0.w;
  const Mask<D> instanced = PlacementHas(d, at.placement, kPlacementInstanced);
  if (!hn::AllFalse(d, instanced)) {
    tangent = Select<D>(instanced, VectorToWorld(d, at.placement.record, tangent), tangent);
    const Mask<D> mirrored = PlacementHas(d, at.placement, kPlacementMirrored);
    handedness = hn::IfThenElse(mirrored, hn::Neg(handedness), handedness);
  }
  // The map is given for the front; its frame stays that of the front when seen from behind, then
  // flips.
  const Vec3<D> normal = Select<D>(s.back, Neg<D>(s.shading), s.shading);
  const Vec3<D> bitangent = Scale(Cross<D>(normal, tangent), handedness);
  const Vec3<D> bent = MulAdd(tangent, x, MulAdd(bitangent, y, Scale(normal, z)));
  const Vec3<D> unit = SafeNormalize(d, bent, normal);
  return Select<D>(active, Select<D>(s.back, Neg<D>(unit), unit), s.shading);
}

/// Turns a shading normal that faces away from the viewer just far enough back, so that every hit
/// can be shaded.
template <class D>
HWY_INLINE Vec3<D> FaceViewer(D d, const Vec3<D>& normal, const Vec3<D>& toward) {
  const Real<D> least = Splat(d, 1e-3);
  const Real<D> cosine = Dot(normal, toward);
  const Mask<D> away = hn::Lt(cosine, least);
  if (hn::AllFalse(d, away)) return normal;
  const Vec3<D> bent = MulAdd(toward, least - cosine, normal);
  return Select<D>(away, SafeNormalize(d, bent, toward), normal);
}

/// Moves `p` off the surface along `normal` by the error bound, then one ulp more in each component
/// (pbrt 6.8.6): the new origin is on the right side of the triangle whatever the rounding was.
template <class D>
HWY_INLINE Vec3<D> OffsetOrigin(D d, const Surface<D>& s) {
  const Vec3<D>& n = s.geometric;
  Real<D> distance = hn::MulAdd(hn::Abs(n.x), s.error.x,
                                hn::MulAdd(hn::Abs(n.y), s.error.y, hn::Abs(n.z) * s.error.z));
  if (IsMutant(Mutant::epsilon_offset)) distance = Splat(d, 1e-4);
  const auto moved = [&](Real<D> p, Real<D> axis) HWY_ATTR {
    const Real<D> offset = axis * distance;
    const Real<D> o = p + offset;
    const Real<D> ulp = hn::Abs(o) * Splat(d, 0x1p-23);
    return o + hn::IfThenElseZero(hn::Ne(offset, hn::Zero(d)), hn::CopySign(ulp, offset));
  };
  return {moved(s.position.x, n.x), moved(s.position.y, n.y), moved(s.position.z, n.z)};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
