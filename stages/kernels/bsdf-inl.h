// The material model: glTF metallic-roughness with KHR_materials_ior and KHR_materials_specular.
//
// Prepare once per vertex, then evaluate and sample. Directions are unit vectors in the local
// frame, z = shading normal, wo.z > 0. Where this departs from the glTF sample BRDF,
// stages/README.md says by how much. Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_BSDF_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_BSDF_INL_H_
#undef CARPOOL_STAGES_KERNELS_BSDF_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_BSDF_INL_H_
#endif

#include "stages/kernels/bsdf_diffuse-inl.h"
#include "stages/kernels/bsdf_multiscatter-inl.h"
#include "stages/kernels/bsdf_specular-inl.h"
#include "stages/mutants.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// A surface point's material after texturing. Values outside their range are clamped to it.
template <class D>
struct SurfaceParams {
  Vec3<D> base_color;      // [0, 1]
  Real<D> metallic;        // [0, 1]
  Real<D> roughness;       // [0.01, 1]; alpha is its square
  Real<D> ior;             // at least 1
  Mask<D> ior_zero;        // KHR_materials_ior 0: the Fresnel term is 1
  Real<D> specular;        // [0, 1]
  Vec3<D> specular_color;  // at least 0
};

/// All lobes, from the top down. A new lobe is a file of its own, named here and set in
/// PrepareBsdf.
template <class D>
struct Bsdf : LobeSet<D, SpecularLobe, MultiScatterLobe, DiffuseLobe> {
  BsdfTablesView tables;
  AlbedoRow<D> row;  // of the base's roughness
  bool matte;        // no lane has an interface: there is the diffuse lobe alone, and no row
};

/// Schlick's term of the dielectric and of the metal, before they are mixed.
template <class D>
struct SchlickTerm {
  Vec3<D> f0;
  Real<D> f90;
};

template <class D>
HWY_INLINE Vec3<D> Clamp01(D d, const Vec3<D>& c) {
  const Real<D> zero = hn::Zero(d), one = Splat(d, 1);
  return {hn::Min(hn::Max(c.x, zero), one), hn::Min(hn::Max(c.y, zero), one),
          hn::Min(hn::Max(c.z, zero), one)};
}

/// KHR_materials_specular: f0 = min(f0(ior) color, 1) specular, f90 = specular.
template <class D>
HWY_INLINE SchlickTerm<D> DielectricInterface(D d, const SurfaceParams<D>& p) {
  const Real<D> one = Splat(d, 1);
  const Real<D> ior = hn::Max(p.ior, one);
  const Real<D> specular = hn::Min(hn::Max(p.specular, hn::Zero(d)), one);
  const Real<D> f0 = hn::IfThenElse(p.ior_zero, one, NormalReflectance(d, ior));
  const Real<D> f90 = hn::IfThenElse(p.ior_zero, one, DielectricF90(d, ior));
  return {Scale<D>(Clamp01<D>(d, Scale<D>(p.specular_color, f0)), specular), f90 * specular};
}

template <class D>
HWY_INLINE Vec3<D> MultiScatterColor(D d, const SchlickTerm<D>& i, Real<D> average_m) {
  return {MultiScatterShare(d, SchlickAverage(d, i.f0.x, i.f90), average_m),
          MultiScatterShare(d, SchlickAverage(d, i.f0.y, i.f90), average_m),
          MultiScatterShare(d, SchlickAverage(d, i.f0.z, i.f90), average_m)};
}

template <class D>
HWY_INLINE Real<D> SumComponents(const Vec3<D>& c) {
  return c.x + c.y + c.z;
}

/// GGX is linear in F0 and F90, so one lobe with mixed values is the mixture of two lobes.
template <class D>
HWY_INLINE void PrepareSpecular(D d, const SchlickTerm<D>& dielectric, const Vec3<D>& base,
                                Real<D> metallic, const AlbedoAt<D>& at_wo, SpecularLobe<D>& lobe) {
  const Real<D> one = Splat(d, 1);
  lobe.f0 = MulAdd<D>(Sub<D>(base, dielectric.f0), metallic, dielectric.f0);
  lobe.f90 = hn::MulAdd(one - dielectric.f90, metallic, dielectric.f90);
  const Real<D> single = hn::Max(one - at_wo.m - at_wo.b, hn::Zero(d));
  lobe.weight = hn::MulAdd(SumComponents<D>(lobe.f0), single, Splat(d, 3) * lobe.f90 * at_wo.b);
}

template <class D>
HWY_INLINE void PrepareMultiScatter(D d, const Vec3<D>& dielectric_share, const Vec3<D>& base,
                                    Real<D> metallic, const AlbedoAt<D>& at_wo,
                                    const AlbedoRow<D>& row, MultiScatterLobe<D>& lobe) {
  Vec3<D> share = Scale<D>(dielectric_share, Splat(d, 1) - metallic);
  if (!hn::AllFalse(d, hn::Gt(metallic, hn::Zero(d)))) {
    const SchlickTerm<D> metal{base, Splat(d, 1)};
    share = MulAdd<D>(MultiScatterColor<D>(d, metal, row.average.m), metallic, share);
  }
  lobe.multi = Scale<D>(share, SafeDiv(d, at_wo.m, row.average.m));
  lobe.weight = SumComponents<D>(lobe.multi) * row.average.m;
  lobe.SetSpread(d, row.log2_spread);
}

/// 1 - E, with the brightest channel's E for all channels, as KHR_materials_specular has it.
template <class D>
HWY_INLINE void PrepareDiffuse(D d, const SchlickTerm<D>& dielectric,
                               const Vec3<D>& dielectric_share, const Vec3<D>& base,
                               Real<D> metallic, const AlbedoAt<D>& at_wo, const AlbedoRow<D>& row,
                               DiffuseLobe<D>& lobe) {
  const Real<D> one = Splat(d, 1);
  const Real<D> f0 = MaxComponent<D>(dielectric.f0);
  lobe.through = one - f0;
  lobe.through_m = MaxComponent<D>(dielectric_share) - f0;
  lobe.through_b = dielectric.f90 - f0;
  const Real<D> average = lobe.Passed(d, row.average);
  lobe.diffuse = Scale<D>(base, SafeDiv(d, lobe.Passed(d, at_wo), average) * (one - metallic));
  lobe.weight = SumComponents<D>(lobe.diffuse) * average;
}

/// What PrepareBsdf makes, to the bit, of lanes that have neither metal nor an interface that
/// reflects: all that it multiplies by zero is left out, and what lobes of no weight do not read
/// is not set.
template <class D>
HWY_INLINE Bsdf<D> PrepareMatte(D d, const BsdfTablesView& tables, const Vec3<D>& base) {
  Bsdf<D> bsdf;
  bsdf.tables = tables;
  bsdf.matte = true;
  bsdf.SpecularLobe<D>::weight = hn::Zero(d);
  bsdf.MultiScatterLobe<D>::weight = hn::Zero(d);
  bsdf.DiffuseLobe<D>::through = Splat(d, 1);
  bsdf.DiffuseLobe<D>::through_m = hn::Zero(d);
  bsdf.DiffuseLobe<D>::through_b = hn::Zero(d);
  bsdf.DiffuseLobe<D>::diffuse = base;
  bsdf.DiffuseLobe<D>::weight = SumComponents<D>(base);
  bsdf.SumWeights(d);
  return bsdf;
}

template <class D>
HWY_INLINE Bsdf<D> PrepareBsdf(D d, const BsdfTablesView& tables, const SurfaceParams<D>& params,
                               const Vec3<D>& wo) {
  const Vec3<D> base = Clamp01<D>(d, params.base_color);
  const Real<D> metallic = hn::Min(hn::Max(params.metallic, hn::Zero(d)), Splat(d, 1));
  const SchlickTerm<D> dielectric = DielectricInterface<D>(d, params);
  const Real<D> reflects =
      hn::Max(hn::Max(dielectric.f90, MaxComponent<D>(dielectric.f0)), metallic);
  if (hn::AllFalse(d, hn::Gt(reflects, hn::Zero(d)))) return PrepareMatte<D>(d, tables, base);

  Bsdf<D> bsdf;
  bsdf.tables = tables;
  bsdf.matte = false;
  bsdf.row = FindAlbedoRow<D>(d, tables, params.roughness);
  const AlbedoAt<D> at_wo = LookUpAlbedo<D>(d, tables, bsdf.row, hn::Max(wo.z, hn::Zero(d)));
  const Vec3<D> share = MultiScatterColor<D>(d, dielectric, bsdf.row.average.m);

  bsdf.SpecularLobe<D>::SetOutgoing(d, bsdf.row.alpha, wo);
  PrepareSpecular<D>(d, dielectric, base, metallic, at_wo, bsdf);
  PrepareMultiScatter<D>(d, share, base, metallic, at_wo, bsdf.row, bsdf);
  PrepareDiffuse<D>(d, dielectric, share, base, metallic, at_wo, bsdf.row, bsdf);
  bsdf.SumWeights(d);
  return bsdf;
}

/// f cos and the sampling density of one direction; zero where wi.z <= 0.
template <class D>
HWY_INLINE BsdfValue<D> EvaluateBsdf(D d, const Bsdf<D>& bsdf, const Vec3<D>& wo,
                                     const Vec3<D>& wi) {
  DirectionPair<D> pair = MakePair(d, wo, wi);
  if (hn::AllFalse(d, pair.reflected)) return {Splat3(d, 0, 0, 0), hn::Zero(d)};
  const Real<D> users = bsdf.MultiScatterLobe<D>::weight + bsdf.DiffuseLobe<D>::weight;
  if (!bsdf.matte && !hn::AllFalse(d, hn::Gt(users, hn::Zero(d)))) {
    pair.albedo = LookUpAlbedo<D>(d, bsdf.tables, bsdf.row, pair.cosine);
  }
  return bsdf.Evaluate(d, pair);
}

template <class D>
HWY_INLINE BsdfSample<D> SampleBsdf(D d, const Bsdf<D>& bsdf, const Vec3<D>& wo, Real<D> u_lobe,
                                    const Vec2<D>& u) {
  const Vec3<D> wi = bsdf.Sample(d, wo, u_lobe, u);
  BsdfValue<D> value = EvaluateBsdf<D>(d, bsdf, wo, wi);
  if (IsMutant(Mutant::large_pdf)) value.pdf = value.pdf * Splat(d, 1.005);
  const Mask<D> valid = hn::Gt(value.pdf, hn::Zero(d));
  const Real<D> inverse = SafeDiv(d, Splat(d, 1), value.pdf);
  return {wi, Scale<D>(value.f_cos, inverse), value.pdf, valid};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
