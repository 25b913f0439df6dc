// Instantiates the BSDF kernels for tests.
#include "tests/stages/bsdf_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/stages/bsdf_kernels.cpp"
#include "hwy/foreach_target.h"

#include "stages/kernels/bsdf-inl.h"
#include "tests/stages/sampling_columns-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

using tests::Columns;

template <class D>
SurfaceParams<D> ParamsOf(D d, const tests::Surface& s) {
  const Real<D> zero = hn::Zero(d);
  return {Splat3(d, s.base[0], s.base[1], s.base[2]),
          Splat(d, s.metallic),
          Splat(d, s.roughness),
          Splat(d, s.ior),
          hn::Gt(Splat(d, s.ior_zero ? 1 : 0), zero),
          Splat(d, s.specular),
          Splat3(d, s.specular_color[0], s.specular_color[1], s.specular_color[2])};
}

template <class D>
Vec3<D> LoadDirection(D d, const Columns& columns, size_t first, size_t i) {
  return {LoadColumn(d, columns[first], i), LoadColumn(d, columns[first + 1], i),
          LoadColumn(d, columns[first + 2], i)};
}
template <class D>
void StoreVector(D d, const Vec3<D>& v, Columns& columns, size_t first, size_t i) {
  StoreColumn(d, v.x, columns[first], i);
  StoreColumn(d, v.y, columns[first + 1], i);
  StoreColumn(d, v.z, columns[first + 2], i);
}

template <class D>
Columns RunSample(const tests::Surface& surface, const tests::Direction& from, const Columns& u) {
  const D d;
  const size_t size = u[0].size();
  Columns out(tests::kSampleColumns, std::vector<double>(size));
  const Vec3<D> wo = Splat3(d, from.x, from.y, from.z);
  const Bsdf<D> bsdf = PrepareBsdf(d, SharedBsdfTables().View(), ParamsOf(d, surface), wo);
  for (size_t i = 0; i < size; i += hn::Lanes(d)) {
    const Vec2<D> point{LoadColumn(d, u[1], i), LoadColumn(d, u[2], i)};
    const BsdfSample<D> s = SampleBsdf(d, bsdf, wo, LoadColumn(d, u[0], i), point);
    StoreVector(d, s.wi, out, tests::kSampleX, i);
    StoreVector(d, s.weight, out, tests::kWeightR, i);
    StoreColumn(d, s.pdf, out[tests::kSamplePdf], i);
    StoreColumn(d, hn::IfThenElseZero(s.valid, Splat(d, 1)), out[tests::kValid], i);
  }
  return out;
}

template <class D>
Columns RunEvaluate(const tests::Surface& surface, const Columns& directions) {
  const D d;
  const size_t size = directions[0].size();
  Columns out(tests::kValueColumns, std::vector<double>(size));
  for (size_t i = 0; i < size; i += hn::Lanes(d)) {
    const Vec3<D> wo = LoadDirection(d, directions, 0, i), wi = LoadDirection(d, directions, 3, i);
    const Bsdf<D> bsdf = PrepareBsdf(d, SharedBsdfTables().View(), ParamsOf(d, surface), wo);
    const BsdfValue<D> value = EvaluateBsdf(d, bsdf, wo, wi);
    StoreVector(d, value.f_cos, out, tests::kValueR, i);
    StoreColumn(d, value.pdf, out[tests::kValuePdf], i);
  }
  return out;
}

template <class D>
Columns RunVisible(double alpha_value, const tests::Direction& from, const Columns& u) {
  const D d;
  const size_t size = u[0].size();
  Columns out(tests::kVisibleColumns, std::vector<double>(size));
  const Vec3<D> wo = Splat3(d, from.x, from.y, from.z);
  const Real<D> alpha = Splat(d, alpha_value);
  for (size_t i = 0; i < size; i += hn::Lanes(d)) {
    const Vec3<D> normal =
        SampleVisibleNormal(d, wo, alpha, Vec2<D>{LoadColumn(d, u[0], i), LoadColumn(d, u[1], i)});
    const Vec3<D> wi = Reflect(wo, normal);
    const Real<D> root_o = SmithRoot(wo, alpha), root_i = SmithRoot(wi, alpha);
    const Real<D> cosine = hn::Max(wi.z, hn::Zero(d));
    const Real<D> ratio =
        MicrofacetScale(d, wo, cosine, root_o, root_i) / VisibleNormalScale(d, wo, root_o);
    StoreVector(d, wi, out, tests::kVisibleX, i);
    StoreColumn(d, ratio, out[tests::kVisibleWeight], i);
  }
  return out;
}

template <class D>
std::vector<double> RunVisiblePdf(double alpha_value, const tests::Direction& from,
                                  const Columns& directions) {
  const D d;
  std::vector<double> out(directions[0].size());
  const Vec3<D> wo = Splat3(d, from.x, from.y, from.z);
  const Real<D> alpha = Splat(d, alpha_value);
  const Real<D> root_o = SmithRoot(wo, alpha);
  for (size_t i = 0; i < out.size(); i += hn::Lanes(d)) {
    const DirectionPair<D> pair = MakePair(d, wo, LoadDirection(d, directions, 0, i));
    const Real<D> distribution = GgxDistribution(d, pair.half, pair.length2, Splat(d, 1) / alpha);
    const Real<D> pdf = VisibleNormalScale(d, wo, root_o) * distribution;
    StoreColumn(d, hn::IfThenElseZero(hn::Gt(pair.half.z, hn::Zero(d)), pdf), out, i);
  }
  return out;
}

template <class D>
Columns RunFresnel(const Columns& in) {
  const D d;
  Columns out(tests::kFresnelColumns, std::vector<double>(in[0].size()));
  for (size_t i = 0; i < in[0].size(); i += hn::Lanes(d)) {
    const Real<D> cosine = LoadColumn(d, in[0], i), eta = LoadColumn(d, in[1], i),
                  k = LoadColumn(d, in[2], i);
    const Real<D> f0 = NormalReflectance(d, eta), f90 = DielectricF90(d, eta);
    StoreColumn(d, FresnelDielectric(d, cosine, eta), out[tests::kDielectric], i);
    StoreColumn(d, FresnelConductor(d, cosine, eta, k), out[tests::kConductor], i);
    StoreColumn(d, SchlickFresnel(d, Vec3<D>{f0, f0, f0}, f90, cosine).y, out[tests::kSchlick], i);
    StoreColumn(d, SchlickAverage(d, f0, f90), out[tests::kSchlickMean], i);
  }
  return out;
}

template <class D>
tests::BsdfKernels BsdfTableOf(D d) {
  return {TagName(d),    sizeof(hn::TFromD<D>) == 8, RunSample<D>, RunEvaluate<D>,
          RunVisible<D>, RunVisiblePdf<D>,           RunFresnel<D>};
}

std::vector<tests::BsdfKernels> BsdfTestTables() {
  return {BsdfTableOf(hn::ScalableTag<float>()), BsdfTableOf(hn::CappedTag<float, 1>()),
          BsdfTableOf(hn::ScalableTag<double>())};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "tests/stages/numerics_targets.h"

namespace carpool::stages {
HWY_EXPORT(BsdfTestTables);

static std::vector<tests::BsdfKernels> CollectBsdfTables() {
  std::vector<tests::BsdfKernels> all;
  const auto append = [&](const std::vector<tests::BsdfKernels>& some) {
    all.insert(all.end(), some.begin(), some.end());
  };
  FOR_EACH_TARGET(BsdfTestTables, append);
  return all;
}
}  // namespace carpool::stages

namespace carpool::tests {

const std::vector<BsdfKernels>& AllBsdfKernels() {
  static const std::vector<BsdfKernels> all = stages::CollectBsdfTables();
  return all;
}

const BsdfKernels& BestBsdfKernels() {
  return AllBsdfKernels()[0];
}
const BsdfKernels& ReferenceBsdfKernels() {
  return AllBsdfKernels()[2];
}

}  // namespace carpool::tests
#endif  // HWY_ONCE
