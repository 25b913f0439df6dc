// Shading: one vertex of each path: transparency, emission, next-event estimation, BSDF sampling,
// roulette.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_SHADE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_SHADE_INL_H_
#undef CARPOOL_STAGES_KERNELS_SHADE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_SHADE_INL_H_
#endif

#include <algorithm>
#include <span>
#include <utility>

#include "stages/kernels/bsdf-inl.h"
#include "stages/kernels/kernels.h"
#include "stages/kernels/light_sample-inl.h"
#include "stages/kernels/octahedral-inl.h"
#include "stages/kernels/path-inl.h"
#include "stages/kernels/surface-inl.h"
#include "stages/sampling/sobol-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// Weight of a sample with density `own` that could also have come from density `other`: power
/// heuristic, as a ratio so that squares neither overflow nor vanish.
template <class D>
HWY_INLINE Real<D> PowerHeuristic(D d, Real<D> own, Real<D> other) {
  const Real<D> ratio = hn::Min(SafeDiv(d, other, own), Splat(d, 1e18));
  return Splat(d, 1) / hn::MulAdd(ratio, ratio, Splat(d, 1));
}

/// Weight of a sample of direct light that strategy `own` made with density `own_pdf`, where the
/// other strategy has `other_pdf`.
template <class D>
HWY_INLINE Real<D> StrategyWeight(D d, const KernelContext& c, DirectSampling own, Real<D> own_pdf,
                                  Real<D> other_pdf) {
  if (IsMutant(Mutant::swapped_mis)) std::swap(own_pdf, other_pdf);
  if (c.direct == DirectSampling::mis) return PowerHeuristic(d, own_pdf, other_pdf);
  return Splat(d, c.direct == own ? 1 : 0);
}

template <class D>
HWY_INLINE Mask<D> AtLeast(D d, Uint<D> depth, uint32_t least) {
  const IntTag<D>
      di;  // depths are small, so the signed comparison, which every target has, is the same
  return hn::RebindMask(
      d, hn::Gt(hn::BitCast(di, depth), hn::Set(di, static_cast<int32_t>(least) - 1)));
}

/// One vertex of the paths in flight, as the steps below hand it on.
template <class D>
struct Vertex {
  PathLanes<D> path;
  Uint<D> depth;   // scattering events before this one
  Uint<D> number;  // of the vertex in the table of sample dimensions: the camera is 0
  SampleKey<D> key;
  TexturePoint<D> at;
  TextureFootprint<D> footprint;
  Real<D> cone_width;   // of the ray cone, here ...
  Real<D> cone_spread;  // ... and its growth per metre on the way
  Vec3<D> toward;       // to the previous vertex
  Vec3<D> throughput;
  Vec3<D> radiance;   // of the path so far, updated by the steps
  Vec3<D> origin;     // of rays that leave
  Vec3<D> geometric;  // unit normals: of the triangle ...
  Vec3<D> shading;    // ... and interpolated, bent by the normal map
};

/// What only the first step needs of it: a vertex lies in memory between the steps.
template <class D>
struct Arrival {
  Int<D> primitive;
  Uint<D> flags;
  SurfacePoint<D> at;
  Triangle<D> triangle;
  Surface<D> surface;
  Vec3<D> ray_origin;
  Real<D> ray_pdf, distance;
};

template <class D>
HWY_INLINE TextureFootprint<D> MakeFootprint(D d, const Vertex<D>& v, const Corners<D>& corners,
                                             Real<D> twice_area) {
  // Width of the cone across the ray, in texture coordinates: the supersampling of the pixel filter
  // takes care of what slant adds (Akenine-Moller et al. 2021 would divide by the cosine, and
  // blur).
  const Real<D> density = SafeDiv(d, TwiceTextureArea<D>(corners), twice_area);
  const Real<D> least = Splat(d, 1e-30);  // a camera inside a surface, a shape without coordinates
  return {InterpolateUv<D>(v.at, corners.v0.uv, corners.v1.uv, corners.v2.uv),
          hn::MulAdd(FastLog2(d, hn::Max(density, least)), Splat(d, 0.5),
                     FastLog2(d, hn::Max(v.cone_width, least))),
          HashUniform(d, v.key, v.number, Purpose::texture_level, hn::Zero(UintTag<D>()))};
}

template <class D>
HWY_INLINE void LoadVertex(D d, const KernelContext& c, const PathLanes<D>& p, Vertex<D>& v,
                           Arrival<D>& a) {
  const UintTag<D> du;
  const IntTag<D> di;
  const Quad<D> origin = PathQuad(d, p, offsetof(PathState, origin));       // and tnear
  const Quad<D> ray = PathQuad(d, p, offsetof(PathState, direction));       // and pdf
  const Quad<D> through = PathQuad(d, p, offsetof(PathState, throughput));  // and cone_width
  const Quad<D> gathered = PathQuad(d, p, offsetof(PathState, radiance));   // and cone_spread
  const Quad<D> names =
      PathQuad(d, p, offsetof(PathState, pixel));  // pixel, sample, flags, placement
  const Quad<D> hit = PathQuad(d, p, offsetof(PathState, primitive));  // primitive, u, v, distance
  v.path = p;
  a.flags = hn::BitCast(du, names.z);
  v.depth = hn::And(a.flags, hn::Set(du, kPathDepthMask));
  v.number = v.depth + hn::Set(du, 1);
  v.key = MakeSampleKey(d, hn::BitCast(du, names.x), hn::BitCast(du, names.y), c.seed);
  a.ray_origin = {origin.x, origin.y, origin.z};
  a.ray_pdf = ray.w;
  a.distance = hit.w;
  v.throughput = {through.x, through.y, through.z};
  v.radiance = {gathered.x, gathered.y, gathered.z};
  v.cone_spread = gathered.w;
  const Vec3<D> direction = {ray.x, ray.y, ray.z};
  v.toward = Neg<D>(direction);

  a.primitive = hn::BitCast(di, hit.x);
  a.at = MakeSurfacePoint(d, c, hn::BitCast(di, names.w), a.primitive, hit.y, hit.z);
  v.at = a.at;
  const Corners<D> corners = GatherCorners(d, c, a.at);
  a.triangle = TriangleToWorld(d, c.geometry, a.at.placement, corners.v0.position,
                               corners.v1.position, corners.v2.position);
  a.surface = MakeSurface(d, a.at, corners, a.triangle, direction);
  v.geometric = a.surface.geometric;

  v.cone_width = hn::MulAdd(v.cone_spread, a.distance, through.w);
  if (MayHaveTextures(v.at.material)) {
    v.footprint = MakeFootprint(d, v, corners, a.surface.twice_area);
  } else {  // nothing will be read
    v.footprint = {{hn::Zero(d), hn::Zero(d)}, hn::Zero(d), hn::Zero(d)};
  }
}

/// Lanes that go straight on: transparent by chance of their alpha, or seen from behind by the
/// camera where the material is single-sided. (Later rays see both sides: a wall must not leak
/// light.)
template <class D>
HWY_INLINE Mask<D> PassesThrough(D d, const Vertex<D>& v, const Arrival<D>& a, Real<D> alpha,
                                 Mask<D> active) {
  const UintTag<D> du;
  Mask<D> transparent = hn::Lt(alpha, alpha);  // never
  if (MayBeTransparent(v.at.material)) {
    const Uint<D> layers =
        hn::ShiftRight<kPathLayerShift>(hn::And(a.flags, hn::Set(du, kPathLayerMask)));
    const Real<D> u = HashUniform(d, v.key, v.number, Purpose::alpha, layers);
    transparent = hn::Ge(u, Opacity(d, v.at, alpha));
  }
  const Mask<D> camera_ray = hn::RebindMask(d, hn::Eq(v.depth, hn::Zero(du)));
  const Mask<D> double_sided = MaterialHas(d, v.at.material, kMaterialDoubleSided);
  const Mask<D> culled = hn::And(hn::AndNot(double_sided, a.surface.back), camera_ray);
  return hn::And(active, hn::Or(transparent, culled));
}

/// next[k] = Next{code[k]} for each lane k of the mask.
template <class D>
HWY_INLINE void SetNext(D d, Mask<D> lanes, Int<D> code, Next* next) {
  static_assert(sizeof(Next) == 1);
  StoreBytes(d, lanes, code, reinterpret_cast<uint8_t*>(next));
}
template <class D>
HWY_INLINE Int<D> CodeOf(D, Next next) {
  return hn::Set(IntTag<D>(), static_cast<int32_t>(next));
}
template <class D>
HWY_INLINE void SetNext(D d, Mask<D> lanes, Next value, Next* next) {
  SetNext(d, lanes, CodeOf(d, value), next);
}

/// The same ray goes on: what it hits next at the same place, or behind, is for tracing to find.
/// Past the largest number of layers the path ends.
template <class D>
HWY_INLINE void ContinueThrough(D d, const PathLanes<D>& p, Uint<D> flags_before, Mask<D> passes,
                                Next* next) {
  const UintTag<D> du;
  const IntTag<D> di;
  const Uint<D> flags = flags_before + hn::Set(du, 1u << kPathLayerShift);
  StoreWord(d, PathTargets<D>(d, p, passes), offsetof(PathState, flags), flags);
  constexpr int32_t kMost = static_cast<int32_t>(kMaxAlphaLayers << kPathLayerShift);
  const Int<D> layers = hn::BitCast(di, hn::And(flags, hn::Set(du, kPathLayerMask)));
  const auto goes_on = hn::Lt(layers, hn::Set(di, kMost));
  SetNext(d, passes, hn::IfThenElse(goes_on, CodeOf(d, Next::trace), CodeOf(d, Next::film)), next);
}

/// What the AOVs want of the first hit.
template <class D>
HWY_INLINE void RecordFirstHit(D d, const KernelContext& c, const Vertex<D>& v, Real<D> distance,
                               const Vec3<D>& albedo, Mask<D> active) {
  const Mask<D> first = hn::And(active, hn::RebindMask(d, hn::Eq(v.depth, hn::Zero(UintTag<D>()))));
  if (hn::AllFalse(d, first)) return;
  HWY_ALIGN float words[7][hn::MaxLanes(D())];
  const Real<D> values[7] = {albedo.x,    albedo.y,    albedo.z, v.shading.x,
                             v.shading.y, v.shading.z, distance};
  for (int i = 0; i < 7; ++i) hn::Store(values[i], d, words[i]);
  HWY_ALIGN int32_t slots[hn::MaxLanes(D())];
  hn::Store(v.path.slot, IntTag<D>(), slots);
  for (uint64_t bits = LaneBits(d, first); bits != 0; bits &= bits - 1) {
    const int lane = __builtin_ctzll(bits);
    const PathState& path = v.path.paths[slots[lane]];
    const Placement& placement = c.geometry.placements[path.placement];
    FirstHit hit;
    for (int k = 0; k < 3; ++k) hit.albedo[k] = words[k][lane];
    for (int k = 0; k < 3; ++k) hit.normal[k] = words[3 + k][lane];
    hit.depth = words[6][lane];
    hit.object = static_cast<uint32_t>(placement.object);
    hit.material = static_cast<uint32_t>(placement.material) + 1;
    c.film->AddFirstHit(path.pixel, path.sample, hit);
  }
}

/// Emission of the surface that was hit, weighted against light sampling from the previous vertex.
template <class D>
HWY_INLINE void AddEmission(D d, const KernelContext& c, const Arrival<D>& a, Vertex<D>& v,
                            Mask<D> active) {
  const Mask<D> front =
      hn::Or(hn::Not(a.surface.back), MaterialHas(d, v.at.material, kMaterialDoubleSided));
  active = hn::And(hn::And(active, front), MaterialHas(d, v.at.material, kMaterialEmissive));
  if (hn::AllFalse(d, active)) return;

  const Vec3<D> emitted = EmittedRadiance(d, c, v.at, v.footprint.uv, active);
  Real<D> weight = Splat(d, 1);
  const IntTag<D> di;
  const Int<D> first_light = FieldInt(d, a.at.placement.record, offsetof(Placement, first_light));
  const Mask<D> sampled =
      hn::And(hn::And(active, IsPresent(d, first_light)), hn::Gt(a.ray_pdf, hn::Zero(d)));
  if (!hn::AllFalse(d, sampled)) {
    const Int<D> light = hn::IfThenElseZero(hn::RebindMask(di, sampled), first_light + a.primitive);
    const Vec3<D> normal =
        DecodeNormal(d, hn::BitCast(UintTag<D>(), PathInt(d, v.path, offsetof(PathState, normal))));
    const Triangle<D>& t = a.triangle;
    const Real<D> pdf =
        lights::LightPdfForTriangleHit(d, c.lights, sampled, a.ray_origin, normal, light, t.p0,
                                       t.p1, t.p2, Neg<D>(v.toward), a.distance);
    if (c.probe != nullptr) c.probe->emission_light_pdf = static_cast<float>(hn::GetLane(pdf));
    // What light sampling never finds has no other strategy, whichever is asked for.
    const Mask<D> findable = hn::And(sampled, hn::Gt(pdf, hn::Zero(d)));
    weight = hn::IfThenElse(findable, StrategyWeight(d, c, DirectSampling::bsdf, a.ray_pdf, pdf),
                            weight);
  }
  if (c.probe != nullptr) c.probe->emission_weight = static_cast<float>(hn::GetLane(weight));
  const Vec3<D> added = Scale(Mul<D>(v.throughput, emitted), weight);
  v.radiance = Select<D>(active, Add<D>(v.radiance, added), v.radiance);
}

template <class D>
HWY_INLINE SurfaceParams<D> MaterialParams(D d, const KernelContext& c, const Vertex<D>& v,
                                           const Vec3<D>& base_color, Mask<D> active) {
  const auto factor = [&](size_t offset) HWY_ATTR { return FieldReal(d, v.at.material, offset); };
  const Rgba<D> mr = MaterialTexture(d, c, v.at, v.footprint, Slot::metallic_roughness, active, 1);
  const Rgba<D> specular = MaterialTexture(d, c, v.at, v.footprint, Slot::specular, active, 1);
  const Rgba<D> tint = MaterialTexture(d, c, v.at, v.footprint, Slot::specular_color, active, 1);
  SurfaceParams<D> params;
  params.base_color = base_color;
  params.metallic = factor(offsetof(Material, metallic)) * mr.rgb.z;
  params.roughness = factor(offsetof(Material, roughness)) * mr.rgb.y;
  params.ior = factor(offsetof(Material, ior));
  params.ior_zero = MaterialHas(d, v.at.material, kMaterialIorZero);
  params.specular = factor(offsetof(Material, specular)) * specular.a;
  params.specular_color =
      Mul<D>(FieldTriple(d, v.at.material, offsetof(Material, specular_color)), tint.rgb);
  return params;
}

/// Radiance that a light sends towards `wi`'s origin; all but textured triangles know theirs
/// already.
template <class D>
HWY_INLINE Vec3<D> SampledRadiance(D d, const KernelContext& c, const lights::LightSample<D>& light,
                                   Mask<D> active) {
  const IntTag<D> di;
  const Mask<D> varies = hn::And(active, light.varies);
  if (hn::AllFalse(d, varies)) return light.radiance_or_irradiance;

  const auto where = hn::RebindMask(di, varies);
  const Int<D> valid = hn::IfThenElseZero(where, light.light);
  const lights::LightName<D> name = lights::LoadLightName(d, c.lights, valid);
  const SurfacePoint<D> at =
      MakeSurfacePoint(d, c, hn::IfThenElseZero(where, name.placement),
                       hn::IfThenElseZero(where, name.primitive), light.b1, light.b2);
  const Vec2<D> uv = FirstCoordinates(d, c, at);
  const Vec3<D> emitted = EmittedRadiance(d, c, at, uv, varies);
  return Select<D>(varies, Mul<D>(light.radiance_or_irradiance, emitted),
                   light.radiance_or_irradiance);
}

/// The shading frame and the lobes there, shared by light and BSDF sampling.
template <class D>
struct Scatter {
  Uint<D> packed_normal;
  Frame<D> frame;
  Vec3<D> wo;  // local
  Bsdf<D> bsdf;
};

template <class D>
struct ShadowRay {
  Vec3<D> direction, radiance;
  Real<D> distance;
  Mask<D> wanted;
};

/// One light, one shadow ray.
template <class D>
HWY_INLINE ShadowRay<D> NextEvent(D d, const KernelContext& c, const Vertex<D>& v,
                                  const Scatter<D>& s, const lights::LightChoice<D>& choice,
                                  Mask<D> active) {
  const lights::LightSample<D> light = lights::SampleChosen(d, c.lights, active, choice, v.origin);
  const Real<D> zero = hn::Zero(d);
  Mask<D> wanted =
      hn::And(hn::And(active, hn::Gt(light.pdf, zero)), hn::Gt(Dot(light.wi, v.geometric), zero));
  ShadowRay<D> shadow = {light.wi, Splat3(d, 0, 0, 0), light.distance, wanted};
  if (hn::AllFalse(d, wanted)) return shadow;

  const BsdfValue<D> f = EvaluateBsdf(d, s.bsdf, s.wo, ToLocal(s.frame, light.wi));
  const Real<D> mis = hn::IfThenElse(light.delta, Splat(d, 1),
                                     StrategyWeight(d, c, DirectSampling::light, light.pdf, f.pdf));
  if (c.probe != nullptr) {
    c.probe->light = hn::GetLane(light.light);
    c.probe->light_pdf = static_cast<float>(hn::GetLane(light.pdf));
    c.probe->light_bsdf_pdf = static_cast<float>(hn::GetLane(f.pdf));
    c.probe->light_weight = static_cast<float>(hn::GetLane(mis));
  }
  const Real<D> scale = SafeDiv(d, mis, light.pdf);
  const Vec3<D> incoming = SampledRadiance(d, c, light, wanted);
  shadow.radiance = Scale(Mul<D>(Mul<D>(v.throughput, f.f_cos), incoming), scale);
  shadow.wanted = hn::And(wanted, hn::Gt(MaxComponent(shadow.radiance), zero));
  // Stops short of the light by what both ends and the plane of a triangle may be off, so that the
  // light never shadows itself: a wall as close to the light as 2^-19 (distance + largest
  // coordinates of both ends), or to its plane as 2^-20 of the distance to its farthest corner, is
  // missed.
  const Vec3<D> end = MulAdd(light.wi, light.distance, v.origin);
  const auto most = [](const Vec3<D>& a) HWY_ATTR {
    return hn::Max(hn::Abs(a.x), hn::Max(hn::Abs(a.y), hn::Abs(a.z)));
  };
  const Real<D> ends = (light.distance + most(v.origin) + most(end)) * Splat(d, 0x1p-19);
  const Real<D> margin = hn::MulAdd(light.distance, light.blur, ends);
  const Mask<D> near_light = hn::Lt(light.distance, Splat(d, 1e29));
  shadow.distance = hn::IfThenElse(near_light, light.distance - margin, light.distance);
  shadow.wanted = hn::And(shadow.wanted, hn::Gt(shadow.distance, zero));
  return shadow;
}

template <class D>
struct Bounce {
  Vec3<D> direction, throughput;
  Real<D> pdf;
  Mask<D> alive;
};

/// Probability with which Russian roulette lets a path go on. The root ends paths later than the
/// throughput itself would, and may begin earlier for it; exponent and scale are those that gave
/// the least relMSE x time over a set of scenes (stages/README.md).
template <class D>
HWY_INLINE Real<D> Survival(D d, Real<D> throughput) {
  return hn::Min(hn::Sqrt(throughput * Splat(d, 1.5)), Splat(d, 1));
}

/// BSDF sample and Russian roulette.
template <class D>
HWY_INLINE Bounce<D> SampleBounce(D d, const KernelContext& c, const Vertex<D>& v,
                                  const Scatter<D>& s, Mask<D> active) {
  const Real<D> u_lobe =
      s.bsdf.matte ? hn::Zero(d) : Sample1D(d, v.key, v.number, Purpose::lobe);  // one lobe: any u
  const Vec2<D> u = Sample2D(d, v.key, v.number, Purpose::bsdf);
  const BsdfSample<D> sample = SampleBsdf(d, s.bsdf, s.wo, u_lobe, u);
  if (c.probe != nullptr) c.probe->lobe = s.bsdf.ChosenLobe(d, u_lobe);
  Bounce<D> b;
  b.direction = ToWorld(s.frame, sample.wi);
  b.throughput = Mul<D>(v.throughput, sample.weight);
  b.pdf = sample.pdf;
  b.alive = hn::And(hn::And(active, sample.valid),
                    hn::And(hn::Gt(Dot(b.direction, v.geometric), hn::Zero(d)),
                            hn::Gt(MaxComponent(b.throughput), hn::Zero(d))));

  const Mask<D> roulette = hn::And(b.alive, AtLeast(d, v.depth, c.roulette_depth));
  if (!hn::AllFalse(d, roulette)) {
    const Real<D> survival = Survival(d, MaxComponent(b.throughput));
    const Real<D> u_roulette = Sample1D(d, v.key, v.number, Purpose::roulette);
    const Mask<D> dies = hn::And(roulette, hn::Ge(u_roulette, survival));
    b.alive = hn::AndNot(dies, b.alive);
    b.throughput =
        Select<D>(roulette, Scale(b.throughput, SafeDiv(d, Splat(d, 1), survival)), b.throughput);
  }
  return b;
}

template <class D>
HWY_INLINE void StoreVertex(D d, const Vertex<D>& v, const Scatter<D>& s,
                            const ShadowRay<D>& shadow, const Bounce<D>& bounce, Mask<D> lanes,
                            Next* next) {
  const UintTag<D> du;
  const IntTag<D> di;
  const Real<D> zero = hn::Zero(d);
  const PathTargets<D> to(d, v.path, lanes);
  if (hn::AllFalse(d, hn::Or(shadow.wanted, bounce.alive))) {
    SetNext(d, lanes, Next::film, next);
    StoreQuad(d, to, offsetof(PathState, radiance), v.radiance.x, v.radiance.y, v.radiance.z,
              v.cone_spread);
    return;
  }
  // Beyond a rough bounce the cone widens by roughly the lobe's width, whose solid angle is about 1
  // / pdf.
  const Real<D> lobe =
      hn::Min(Splat(d, 0.25) / hn::Sqrt(hn::Max(bounce.pdf, Splat(d, 1e-6))), Splat(d, 0.5));
  const Uint<D> flags =
      hn::Or(v.depth + hn::Set(du, 1),
             hn::IfThenElseZero(hn::RebindMask(du, bounce.alive), hn::Set(du, kPathAlive)));
  const Real<D> shadow_distance = hn::IfThenElseZero(shadow.wanted, shadow.distance);
  StoreQuad(d, to, offsetof(PathState, origin), v.origin.x, v.origin.y, v.origin.z, zero);
  StoreQuad(d, to, offsetof(PathState, direction), bounce.direction.x, bounce.direction.y,
            bounce.direction.z, bounce.pdf);
  StoreQuad(d, to, offsetof(PathState, throughput), bounce.throughput.x, bounce.throughput.y,
            bounce.throughput.z, v.cone_width);
  StoreQuad(d, to, offsetof(PathState, radiance), v.radiance.x, v.radiance.y, v.radiance.z,
            v.cone_spread + lobe);
  StoreWord(d, to, offsetof(PathState, flags), flags);
  StoreQuad(d, to, offsetof(PathState, shadow_direction), shadow.direction.x, shadow.direction.y,
            shadow.direction.z, shadow_distance);
  StoreQuad(d, to, offsetof(PathState, shadow_radiance), shadow.radiance.x, shadow.radiance.y,
            shadow.radiance.z, s.packed_normal);
  const Int<D> unshadowed = hn::IfThenElse(hn::RebindMask(di, bounce.alive), CodeOf(d, Next::trace),
                                           CodeOf(d, Next::film));
  SetNext(d, lanes,
          hn::IfThenElse(hn::RebindMask(di, shadow.wanted), CodeOf(d, Next::shadow), unshadowed),
          next);
}

/// Ends paths that gather nothing more.
template <class D>
HWY_INLINE void EndPaths(D d, const Vertex<D>& v, Mask<D> lanes, Next* next) {
  StoreQuad(d, PathTargets<D>(d, v.path, lanes), offsetof(PathState, radiance), v.radiance.x,
            v.radiance.y, v.radiance.z, v.cone_spread);
  SetNext(d, lanes, Next::film, next);
}

/// One vector of paths on its way through the steps of shading.
template <class D>
struct Shading {
  Mask<D> active;  // lanes that have a next step
  bool ended;      // none has
  Vertex<D> v;
  Vec3<D> base_color;
  Scatter<D> s;
  lights::LightChoice<D> choice;
  ShadowRay<D> shadow;
};

/// What was hit: transparency, emission, and who ends there.
template <class D>
HWY_INLINE void Arrive(D d, const KernelContext& c, const PathLanes<D>& p, Shading<D>& w,
                       Next* next) {
  Vertex<D>& v = w.v;
  Arrival<D> a;
  LoadVertex(d, c, p, v, a);
  const Rgba<D> base = BaseColor(d, c, a.at, v.footprint, p.active);
  w.base_color = base.rgb;
  w.ended = true;

  const Mask<D> passes = PassesThrough(d, v, a, base.a, p.active);
  if (!hn::AllFalse(d, passes)) ContinueThrough(d, p, a.flags, passes, next);
  Mask<D> active = hn::AndNot(passes, p.active);
  if (hn::AllFalse(d, active)) return;

  v.shading = FaceViewer(d, MappedNormal(d, c, a.at, a.surface, v.footprint, active), v.toward);
  if (c.first_hits) RecordFirstHit(d, c, v, a.distance, base.rgb, active);

  const Mask<D> unlit = hn::And(active, MaterialHas(d, v.at.material, kMaterialUnlit));
  v.radiance = Select<D>(unlit, Add<D>(v.radiance, Mul<D>(v.throughput, base.rgb)), v.radiance);
  AddEmission(d, c, a, v, hn::AndNot(unlit, active));

  const Mask<D> deep = AtLeast(d, v.depth, c.max_depth);
  const Mask<D> ends = hn::And(active, hn::Or(unlit, deep));
  if (!hn::AllFalse(d, ends)) EndPaths(d, v, ends, next);
  w.active = hn::AndNot(ends, active);
  w.ended = hn::AllFalse(d, w.active);
  v.origin = OffsetOrigin(d, a.surface);
}

/// The frame and the lobes there.
template <class D>
HWY_INLINE void Prepare(D d, const KernelContext& c, Shading<D>& w) {
  const Vertex<D>& v = w.v;
  Scatter<D>& s = w.s;
  s.packed_normal = EncodeNormal(d, v.shading);
  s.frame = MakeFrame(d, v.shading);
  s.wo = ToLocal(s.frame, v.toward);
  s.bsdf = PrepareBsdf(d, c.bsdf, MaterialParams(d, c, v, w.base_color, w.active), s.wo);
}

template <class D>
HWY_INLINE void BeginChoice(D d, const KernelContext& c, Shading<D>& w) {
  const Real<D> u_pick = Sample1D(d, w.v.key, w.v.number, Purpose::light_pick);
  const Vec2<D> u_point = Sample2D(d, w.v.key, w.v.number, Purpose::light_point);
  const Vec3<D> normal = DecodeNormal(d, w.s.packed_normal);
  lights::BeginChoice(d, c.lights, w.active, w.v.origin, normal, u_pick, u_point, w.choice);
}

template <class D>
HWY_INLINE void Connect(D d, const KernelContext& c, Shading<D>& w) {
  w.shadow = NextEvent(d, c, w.v, w.s, w.choice, w.active);
}

template <class D>
HWY_INLINE void Leave(D d, const KernelContext& c, const Shading<D>& w, Next* next) {
  const Bounce<D> bounce = SampleBounce(d, c, w.v, w.s, w.active);
  StoreVertex(d, w.v, w.s, w.shadow, bounce, w.active, next);
}

/// All steps of one vector.
template <class D>
HWY_NOINLINE void ShadeLanes(D d, const KernelContext& c, const PathLanes<D>& p, Next* next) {
  Shading<D> w;
  Arrive(d, c, p, w, next);
  if (w.ended) return;
  Prepare(d, c, w);
  BeginChoice(d, c, w);
  while (!lights::IsChosen(d, w.choice)) lights::ChooseOn(d, c.lights, w.choice);
  Connect(d, c, w);
  Leave(d, c, w, next);
}

template <class D>
HWY_NOINLINE void ArriveAll(D d, const KernelContext& c, PathState* paths,
                            std::span<const uint32_t> slots, Shading<D>* w, Next* next) {
  for (size_t i = 0; i < slots.size(); i += hn::Lanes(d)) {
    PrefetchSlots(paths, slots, i + hn::Lanes(d), hn::Lanes(d));
    Arrive(d, c, LoadSlots(d, paths, slots.data() + i, slots.size() - i), *w++, next + i);
  }
}
template <class D>
HWY_NOINLINE void PrepareAll(D d, const KernelContext& c, std::span<Shading<D>> all) {
  for (Shading<D>& w : all) {
    if (!w.ended) Prepare(d, c, w);
  }
}
/// Vectors take turns, level by level of the light tree.
template <class D>
HWY_NOINLINE void ChooseAll(D d, const KernelContext& c, std::span<Shading<D>> all) {
  for (Shading<D>& w : all) {
    if (!w.ended) BeginChoice(d, c, w);
  }
  for (bool all_chosen = false; !all_chosen;) {
    all_chosen = true;
    for (Shading<D>& w : all) {
      if (w.ended || lights::IsChosen(d, w.choice)) continue;
      lights::ChooseOn(d, c.lights, w.choice);
      all_chosen = false;
    }
  }
}
template <class D>
HWY_NOINLINE void ConnectAll(D d, const KernelContext& c, std::span<Shading<D>> all) {
  for (Shading<D>& w : all) {
    if (!w.ended) Connect(d, c, w);
  }
}
template <class D>
HWY_NOINLINE void LeaveAll(D d, const KernelContext& c, std::span<Shading<D>> all, Next* next) {
  for (Shading<D>& w : all) {
    if (!w.ended) Leave(d, c, w, next);
    next += hn::Lanes(d);
  }
}

/// Step by step, a few vectors each: the whole of shading is more code than fits the first-level
/// instruction cache.
template <class D>
HWY_INLINE void ShadePaths(D d, const KernelContext& c, PathState* paths,
                           std::span<const uint32_t> slots, Next* next) {
  if constexpr (hn::MaxLanes(D()) == 1) {
    for (size_t i = 0; i < slots.size(); ++i)
      ShadeLanes(d, c, LoadSlots(d, paths, slots.data() + i, 1), next + i);
  } else {
    constexpr size_t kPaths = 64;  // what is between the steps fits the second-level cache
    Shading<D> work[kPaths / hn::MaxLanes(D())];
    for (; !slots.empty(); slots = slots.subspan(std::min(kPaths, slots.size())), next += kPaths) {
      const auto some = slots.first(std::min(kPaths, slots.size()));
      ArriveAll(d, c, paths, some, work, next);
      const std::span<Shading<D>> all(work, (some.size() + hn::Lanes(d) - 1) / hn::Lanes(d));
      PrepareAll(d, c, all);
      ChooseAll(d, c, all);
      ConnectAll(d, c, all);
      LeaveAll(d, c, all, next);
    }
  }
}

/// Paths that left the scene gather the environment, weighted against light sampling, and end.
template <class D>
HWY_INLINE void MissLanes(D d, const KernelContext& c, const PathLanes<D>& p) {
  if (c.lights.environment.width == 0) return;
  const Quad<D> ray = PathQuad(d, p, offsetof(PathState, direction));       // and pdf
  const Quad<D> through = PathQuad(d, p, offsetof(PathState, throughput));  // and cone_width
  const Quad<D> gathered = PathQuad(d, p, offsetof(PathState, radiance));   // and cone_spread
  const Vec3<D> direction = {ray.x, ray.y, ray.z};
  const Real<D> pdf = ray.w;
  const Mask<D> bounced = hn::Gt(pdf, hn::Zero(d));
  const EnvironmentValue<D> environment = LookUpEnvironment(d, c.lights.environment, direction);
  const Real<D> light_pdf = environment.pdf * Splat(d, c.lights.environment_probability);
  const Real<D> weight = hn::IfThenElse(
      bounced, StrategyWeight(d, c, DirectSampling::bsdf, pdf, light_pdf), Splat(d, 1));
  if (c.probe != nullptr) {
    c.probe->emission_light_pdf = static_cast<float>(hn::GetLane(light_pdf));
    c.probe->emission_weight = static_cast<float>(hn::GetLane(weight));
  }
  const Vec3<D> throughput = {through.x, through.y, through.z};
  const Vec3<D> before = {gathered.x, gathered.y, gathered.z};
  const Vec3<D> sum = Add<D>(before, Scale(Mul<D>(throughput, environment.radiance), weight));
  StoreQuad(d, PathTargets<D>(d, p, p.active), offsetof(PathState, radiance), sum.x, sum.y, sum.z,
            gathered.w);
}

/// Opacity of one point for shadow rays, from the finest mip level.
template <class D>
HWY_INLINE Real<D> PointOpacity(D d, const KernelContext& c, int32_t placement, uint32_t primitive,
                                float u, float v) {
  const IntTag<D> di;
  const SurfacePoint<D> at =
      MakeSurfacePoint(d, c, hn::Set(di, placement), hn::Set(di, static_cast<int32_t>(primitive)),
                       Splat(d, u), Splat(d, v));
  const TextureFootprint<D> finest = {FirstCoordinates(d, c, at), Splat(d, -100), hn::Zero(d)};
  const Mask<D> all = hn::FirstN(d, hn::Lanes(d));
  return Opacity(d, at, BaseColor(d, c, at, finest, all).a);
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
