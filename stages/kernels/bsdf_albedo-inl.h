// Directional albedos of GGX lobes, read from the tables of stages/tables/bsdf_tables.h.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_BSDF_ALBEDO_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_BSDF_ALBEDO_INL_H_
#undef CARPOOL_STAGES_KERNELS_BSDF_ALBEDO_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_BSDF_ALBEDO_INL_H_
#endif

#include "stages/kernels/bsdf_fresnel-inl.h"
#include "stages/sampling/lookup-inl.h"
#include "stages/tables/bsdf_tables.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// M: share of light that leaves a white lobe only after more than one bounce; B: its
/// Schlick-weighted share. The single-scatter albedo for F0 and F90 is F0 (1 - M - B) + F90 B.
template <class D>
struct AlbedoAt {
  Real<D> m, b;
};

/// A lobe's place on the table's roughness axis.
template <class D>
struct AlbedoRow {
  Real<D> alpha;
  Real<D> fraction;     // towards the next row
  Index<D> base;        // first cosine of the row
  AlbedoAt<D> average;  // cosine-weighted means over the hemisphere
  Real<D> log2_spread;  // see kSpreadPerAlpha2
};

template <class D>
HWY_INLINE Real<D> UpperHalf16(D d, Index<D> word) {
  const WordTag<D> dw;
  return FromIndex(d, hn::BitCast(IndexTag<D>(), hn::ShiftRight<16>(hn::BitCast(dw, word))));
}
template <class D>
HWY_INLINE Real<D> LowerHalf16(D d, Index<D> word) {
  return FromIndex(d, hn::And(word, hn::Set(IndexTag<D>(), 0xffff)));
}
template <class D>
HWY_INLINE Real<D> LerpReal(Real<D> t, Real<D> a, Real<D> b) {
  return hn::MulAdd(t, b - a, a);
}

/// Clamps roughness to [kMinRoughness, 1], so alpha to [1e-4, 1].
template <class D>
HWY_INLINE AlbedoRow<D> FindAlbedoRow(D d, const BsdfTablesView& tables, Real<D> roughness) {
  const IndexTag<D> di;
  const Real<D> low = Splat(d, kMinRoughness);
  const Real<D> r = hn::Min(hn::Max(roughness, low), Splat(d, 1));
  const Real<D> unit = (r - low) * Splat(d, 1 / (1 - kMinRoughness));
  const Real<D> position = unit * Splat(d, kAlbedoRoughnesses - 1);
  const Index<D> row = hn::Min(ToIndex(d, position), hn::Set(di, kAlbedoRoughnesses - 2));
  const Real<D> average_position = unit * Splat(d, kAverageRoughnesses - 1);
  const Index<D> knot = hn::Min(ToIndex(d, average_position), hn::Set(di, kAverageRoughnesses - 2));
  const Real<D> t = average_position - FromIndex(d, knot);
  const Index<D> at = knot * hn::Set(di, kAverageColumns);
  const Quad<D> a = LookUpQuad(d, tables.average, at);
  const Quad<D> b = LookUpQuad(d, tables.average + kAverageColumns, at);
  return {r * r,
          position - FromIndex(d, row),
          row * hn::Set(di, kAlbedoCosines),
          {LerpReal<D>(t, a.x, b.x), LerpReal<D>(t, a.y, b.y)},
          LerpReal<D>(t, a.z, b.z)};
}

/// Bilinear look-up at cosine mu >= 0.
template <class D>
HWY_INLINE AlbedoAt<D> LookUpAlbedo(D d, const BsdfTablesView& tables, const AlbedoRow<D>& row,
                                    Real<D> mu) {
  const IndexTag<D> di;
  const Real<D> one = Splat(d, 1);
  mu = hn::Min(mu, one);
  const Real<D> follow = hn::Sqrt(mu * (one + row.alpha) / (mu + row.alpha));
  const Real<D> position =
      hn::MulAdd(follow, Splat(d, kAlbedoCoordinateShare * (kAlbedoCosines - 1)),
                 mu * Splat(d, (1 - kAlbedoCoordinateShare) * (kAlbedoCosines - 1)));
  const Index<D> column = hn::Min(ToIndex(d, position), hn::Set(di, kAlbedoCosines - 2));
  const Real<D> t = position - FromIndex(d, column);
  const Index<D> at = row.base + column;

  const WordPair<D> row0 = LookUpWordPair(d, tables.albedo, at);
  const WordPair<D> row1 = LookUpWordPair(d, tables.albedo + kAlbedoCosines, at);
  const Real<D> m0 = LerpReal<D>(t, UpperHalf16(d, row0.first), UpperHalf16(d, row0.second));
  const Real<D> m1 = LerpReal<D>(t, UpperHalf16(d, row1.first), UpperHalf16(d, row1.second));
  const Real<D> c0 = LerpReal<D>(t, LowerHalf16(d, row0.first), LowerHalf16(d, row0.second));
  const Real<D> c1 = LerpReal<D>(t, LowerHalf16(d, row1.first), LowerHalf16(d, row1.second));
  const Real<D> m = LerpReal<D>(row.fraction, m0, m1) * Splat(d, kAlbedoUnitM);
  const Real<D> c = hn::MulSub(LerpReal<D>(row.fraction, c0, c1), Splat(d, kAlbedoUnitC), one);
  return {m, hn::Max(hn::MulAdd(one - m, SchlickWeight(d, mu), c), hn::Zero(d))};
}

/// Share of Schlick-reflected light that leaves after two or more bounces, of the M that does so
/// for a white lobe (Kulla and Conty 2017, with the square that makes it start at the second
/// bounce).
template <class D>
HWY_INLINE Real<D> MultiScatterShare(D d, Real<D> average_fresnel, Real<D> average_m) {
  const Real<D> one = Splat(d, 1);
  return average_fresnel * average_fresnel * (one - average_m) /
         hn::NegMulAdd(average_fresnel, average_m, one);
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
