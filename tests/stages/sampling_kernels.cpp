// Instantiates the sampling and numeric kernels for tests.
#include "tests/stages/sampling_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/stages/sampling_kernels.cpp"
#include "hwy/foreach_target.h"

#include "stages/sampling/filter-inl.h"
#include "stages/sampling/sobol-inl.h"
#include "stages/sampling/warp-inl.h"
#include "tests/stages/sampling_columns-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

using tests::Columns;
using tests::Draws;

template <class D>
SampleKey<D> KeyOf(D d, const Draws& draws, size_t i) {
  return MakeSampleKey(d, LoadWords(d, draws.pixel, i), LoadWords(d, draws.sample, i), draws.seed);
}

template <class D>
std::vector<double> RunUnit(const tests::Words& words) {
  const D d;
  std::vector<double> out(words.size());
  for (size_t i = 0; i < out.size(); i += hn::Lanes(d)) {
    StoreColumn(d, UnitFromWord(d, LoadWords(d, words, i)), out, i);
  }
  return out;
}

template <class D>
std::vector<double> RunSample1(const Draws& draws) {
  const D d;
  std::vector<double> out(draws.pixel.size());
  for (size_t i = 0; i < out.size(); i += hn::Lanes(d)) {
    StoreColumn(d, Sample1D(d, KeyOf(d, draws, i), LoadWords(d, draws.vertex, i), draws.purpose),
                out, i);
  }
  return out;
}

template <class D>
Columns RunSample2(const Draws& draws) {
  const D d;
  Columns out(2, std::vector<double>(draws.pixel.size()));
  for (size_t i = 0; i < draws.pixel.size(); i += hn::Lanes(d)) {
    const Vec2<D> u = Sample2D(d, KeyOf(d, draws, i), LoadWords(d, draws.vertex, i), draws.purpose);
    StoreColumn(d, u.x, out[0], i);
    StoreColumn(d, u.y, out[1], i);
  }
  return out;
}

template <class D>
std::vector<double> RunHash(const Draws& draws) {
  const D d;
  std::vector<double> out(draws.pixel.size());
  for (size_t i = 0; i < out.size(); i += hn::Lanes(d)) {
    StoreColumn(d,
                HashUniform(d, KeyOf(d, draws, i), LoadWords(d, draws.vertex, i), draws.purpose,
                            LoadWords(d, draws.iteration, i)),
                out, i);
  }
  return out;
}

// Each function of columns is a struct, so that one loop serves them all.
struct FilterFunction {
  static constexpr size_t kIn = 2, kOut = 2;
  template <class D>
  static void Call(D d, const Real<D>* in, Real<D>* out) {
    const Vec2<D> offset = SamplePixelFilter(d, Vec2<D>{in[0], in[1]});
    out[0] = offset.x;
    out[1] = offset.y;
  }
};
struct CosineFunction {
  static constexpr size_t kIn = 2, kOut = 3;
  template <class D>
  static void Call(D d, const Real<D>* in, Real<D>* out) {
    const Vec3<D> w = SampleCosineHemisphere(d, Vec2<D>{in[0], in[1]});
    out[0] = w.x;
    out[1] = w.y;
    out[2] = w.z;
  }
};
struct CosSinFunction {
  static constexpr size_t kIn = 1, kOut = 2;
  template <class D>
  static void Call(D d, const Real<D>* in, Real<D>* out) {
    const Vec2<D> turn = CosSinTurns(d, in[0]);
    out[0] = turn.x;
    out[1] = turn.y;
  }
};
struct Exp2Function {
  static constexpr size_t kIn = 1, kOut = 1;
  template <class D>
  static void Call(D d, const Real<D>* in, Real<D>* out) {
    out[0] = Exp2Minus1(d, in[0]);
  }
};
struct FrameFunction {
  static constexpr size_t kIn = 3, kOut = 6;
  template <class D>
  static void Call(D d, const Real<D>* in, Real<D>* out) {
    const Frame<D> frame = MakeFrame(d, Vec3<D>{in[0], in[1], in[2]});
    const Real<D> all[] = {frame.t.x, frame.t.y, frame.t.z, frame.b.x, frame.b.y, frame.b.z};
    for (size_t k = 0; k < kOut; ++k) out[k] = all[k];
  }
};
struct SafeSqrtFunction {
  static constexpr size_t kIn = 1, kOut = 1;
  template <class D>
  static void Call(D d, const Real<D>* in, Real<D>* out) {
    out[0] = SafeSqrt(d, in[0]);
  }
};
struct SafeDivFunction {
  static constexpr size_t kIn = 2, kOut = 1;
  template <class D>
  static void Call(D d, const Real<D>* in, Real<D>* out) {
    out[0] = SafeDiv(d, in[0], in[1]);
  }
};
struct SafeNormalizeFunction {
  static constexpr size_t kIn = 3, kOut = 3;
  template <class D>
  static void Call(D d, const Real<D>* in, Real<D>* out) {
    const Vec3<D> v = SafeNormalize(d, Vec3<D>{in[0], in[1], in[2]}, Splat3(d, 0, 0, 1));
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
  }
};

template <class D, class Function>
Columns RunColumns(const Columns& in) {
  const D d;
  const size_t size = in[0].size();
  Columns out(Function::kOut, std::vector<double>(size));
  for (size_t i = 0; i < size; i += hn::Lanes(d)) {
    Real<D> arguments[Function::kIn], results[Function::kOut];
    for (size_t k = 0; k < Function::kIn; ++k) arguments[k] = LoadColumn(d, in[k], i);
    Function::Call(d, arguments, results);
    for (size_t k = 0; k < Function::kOut; ++k) StoreColumn(d, results[k], out[k], i);
  }
  return out;
}

template <class D>
tests::SamplingKernels TableOf(D d) {
  return {TagName(d),
          sizeof(hn::TFromD<D>) == 8,
          RunUnit<D>,
          RunSample1<D>,
          RunSample2<D>,
          RunHash<D>,
          RunColumns<D, FilterFunction>,
          RunColumns<D, CosineFunction>,
          RunColumns<D, CosSinFunction>,
          RunColumns<D, Exp2Function>,
          RunColumns<D, FrameFunction>,
          RunColumns<D, SafeSqrtFunction>,
          RunColumns<D, SafeDivFunction>,
          RunColumns<D, SafeNormalizeFunction>};
}

std::vector<tests::SamplingKernels> SamplingTables() {
  return {TableOf(hn::ScalableTag<float>()), TableOf(hn::CappedTag<float, 1>()),
          TableOf(hn::ScalableTag<double>())};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "tests/stages/numerics_targets.h"

namespace carpool::stages {
HWY_EXPORT(SamplingTables);

static std::vector<tests::SamplingKernels> CollectSamplingTables() {
  std::vector<tests::SamplingKernels> all;
  const auto append = [&](const std::vector<tests::SamplingKernels>& some) {
    all.insert(all.end(), some.begin(), some.end());
  };
  FOR_EACH_TARGET(SamplingTables, append);
  return all;
}
}  // namespace carpool::stages

namespace carpool::tests {

const std::vector<SamplingKernels>& AllSamplingKernels() {
  static const std::vector<SamplingKernels> all = stages::CollectSamplingTables();
  return all;
}

const SamplingKernels& BestSamplingKernels() {
  return AllSamplingKernels().front();
}

}  // namespace carpool::tests
#endif  // HWY_ONCE
