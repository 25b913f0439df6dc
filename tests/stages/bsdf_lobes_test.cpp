// A lobe made for this test is put on top of the material's lobes: what adding one takes, and that
// the set samples, weighs and layers it without further code.
#include <gtest/gtest.h>

#include <cmath>

#include "hwy/highway.h"
#include "stages/kernels/bsdf-inl.h"
#include "tests/stages/bsdf_directions.h"
#include "tests/stages/sampling_columns-inl.h"
#include "tests/support/statistics.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// A varnish of ior 1.5: single-scattering GGX that covers what lies below, layered by its albedo.
template <class D>
struct VarnishLobe {
  Real<D> weight;
  SpecularLobe<D> reflection;
  BsdfTablesView tables;
  AlbedoRow<D> row;
  Real<D> scale;  // T(wo) / T_avg

  HWY_INLINE Vec3<D> Sample(D d, const Vec3<D>& wo, const Vec2<D>& u) const {
    return reflection.Sample(d, wo, u);
  }

  HWY_INLINE void Evaluate(D d, const DirectionPair<D>& pair, LobeSum<D>& sum) const {
    reflection.Evaluate(d, pair, sum);
    sum.below = sum.below * scale * Through(d, LookUpAlbedo<D>(d, tables, row, pair.cosine));
  }

  HWY_INLINE Real<D> Through(D d, const AlbedoAt<D>& at) const {
    const Real<D> one = Splat(d, 1);
    return one - reflection.f0.x * (one - at.m - at.b) - at.b;
  }
};

template <class D>
struct VarnishedBsdf : LobeSet<D, VarnishLobe, SpecularLobe, MultiScatterLobe, DiffuseLobe> {};

template <class D>
VarnishedBsdf<D> PrepareVarnished(D d, double roughness, const SurfaceParams<D>& base,
                                  const Vec3<D>& wo) {
  const BsdfTablesView tables = SharedBsdfTables().View();
  VarnishedBsdf<D> bsdf;
  VarnishLobe<D>& varnish = bsdf;
  varnish.tables = tables;
  varnish.row = FindAlbedoRow(d, tables, Splat(d, roughness));
  varnish.reflection.SetOutgoing(d, varnish.row.alpha, wo);
  varnish.reflection.f0 = Splat3(d, 0.04, 0.04, 0.04);
  varnish.reflection.f90 = Splat(d, 1);
  const Real<D> through = varnish.Through(d, LookUpAlbedo(d, tables, varnish.row, wo.z));
  varnish.scale = through / varnish.Through(d, varnish.row.average);
  varnish.weight = varnish.reflection.weight = Splat(d, 3) * (Splat(d, 1) - through);

  const Bsdf<D> below = PrepareBsdf(d, tables, base, wo);
  static_cast<SpecularLobe<D>&>(bsdf) = below;
  static_cast<MultiScatterLobe<D>&>(bsdf) = below;
  static_cast<DiffuseLobe<D>&>(bsdf) = below;
  bsdf.SpecularLobe<D>::weight = below.SpecularLobe<D>::weight * through;
  bsdf.MultiScatterLobe<D>::weight = below.MultiScatterLobe<D>::weight * through;
  bsdf.DiffuseLobe<D>::weight = below.DiffuseLobe<D>::weight * through;
  bsdf.SumWeights(d);
  return bsdf;
}

/// Mean weight over one scramble.
double VarnishedFurnace(double roughness, double mu, const tests::Columns& u) {
  using D = hn::ScalableTag<float>;
  const D d;
  const tests::Direction from = tests::OutgoingAt(mu);
  const Vec3<D> wo = Splat3(d, from.x, from.y, from.z);
  const Real<D> one = Splat(d, 1);
  const SurfaceParams<D> white{Splat3(d, 1, 1, 1), hn::Zero(d),       one, one, hn::Lt(one, one),
                               hn::Zero(d),        Splat3(d, 1, 1, 1)};
  const VarnishedBsdf<D> bsdf = PrepareVarnished(d, roughness, white, wo);
  std::vector<double> weights(u[0].size());
  for (size_t i = 0; i < weights.size(); i += hn::Lanes(d)) {
    const Vec2<D> point{LoadColumn(d, u[1], i), LoadColumn(d, u[2], i)};
    const Vec3<D> wi = bsdf.Sample(d, wo, LoadColumn(d, u[0], i), point);
    const BsdfValue<D> value = bsdf.Evaluate(d, MakePair(d, wo, wi));
    StoreColumn(d, SafeDiv(d, value.f_cos.x, value.pdf), weights, i);
  }
  double sum = 0;
  for (const double weight : weights) sum += weight;
  return sum / static_cast<double>(weights.size());
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

namespace carpool::tests {
namespace {

// The varnish has no further bounces of its own, so it is smooth enough to lose next to nothing.
TEST(BsdfLobes, VarnishOverWhiteReturnsAllLight) {
  for (const double roughness : {0.0, 0.1, 0.2}) {
    for (const double mu : {0.2, 0.5, 1.0}) {
      test::Mean mean;
      for (uint32_t s = 0; s < 16; ++s)
        mean.Add(stages::HWY_NAMESPACE::VarnishedFurnace(roughness, mu, SamplerUniforms(s, 4096)));
      EXPECT_NEAR(mean.Value(), 1, stages::kAlbedoResidual + 7.8 * mean.Error())
          << "roughness " << roughness << ", mu " << mu;
      EXPECT_LT(mean.Error(), 1e-3);
    }
  }
}

}  // namespace
}  // namespace carpool::tests
