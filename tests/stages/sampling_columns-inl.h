// Moves columns of numbers through SIMD lanes of any width and type.

#if defined(CARPOOL_TESTS_STAGES_SAMPLING_COLUMNS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_TESTS_STAGES_SAMPLING_COLUMNS_INL_H_
#undef CARPOOL_TESTS_STAGES_SAMPLING_COLUMNS_INL_H_
#else
#define CARPOOL_TESTS_STAGES_SAMPLING_COLUMNS_INL_H_
#endif

#include <cstddef>
#include <string>
#include <vector>

#include "stages/sampling/lookup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

constexpr size_t kMostLanes = 64;

template <class D>
HWY_INLINE Real<D> LoadColumn(D d, const std::vector<double>& column, size_t i) {
  hn::TFromD<D> lanes[kMostLanes];
  for (size_t l = 0; l < hn::Lanes(d); ++l) lanes[l] = static_cast<hn::TFromD<D>>(column[i + l]);
  return hn::LoadU(d, lanes);
}
template <class D>
HWY_INLINE Word<D> LoadWords(D, const std::vector<uint32_t>& column, size_t i) {
  return hn::LoadU(WordTag<D>(), &column[i]);
}
template <class D>
HWY_INLINE void StoreColumn(D d, Real<D> value, std::vector<double>& column, size_t i) {
  hn::TFromD<D> lanes[kMostLanes];
  hn::StoreU(value, d, lanes);
  for (size_t l = 0; l < hn::Lanes(d); ++l) column[i + l] = static_cast<double>(lanes[l]);
}

template <class D>
std::string TagName(D d) {
  return std::string(hwy::TargetName(HWY_TARGET)) +
         (sizeof(hn::TFromD<D>) == 8 ? " double x" : " x") + std::to_string(hn::Lanes(d));
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
