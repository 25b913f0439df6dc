// Unit vectors as 32 bits, for path state.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_OCTAHEDRAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_OCTAHEDRAL_INL_H_
#undef CARPOOL_STAGES_KERNELS_OCTAHEDRAL_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_OCTAHEDRAL_INL_H_
#endif

#include "stages/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// Unit vector to 2 x 16 bit octahedral coordinates (Cigolle et al. 2014) and back. Selection of
/// lights and its MIS counterpart both use the decoded one, so its rounding never biases.
template <class D>
HWY_INLINE Uint<D> EncodeNormal(D d, const Vec3<D>& n) {
  const Real<D> one = Splat(d, 1);
  const Real<D> inverse = one / (hn::Abs(n.x) + hn::Abs(n.y) + hn::Abs(n.z));
  const Real<D> px = n.x * inverse, py = n.y * inverse;
  const Mask<D> lower = hn::Lt(n.z, hn::Zero(d));
  const Real<D> x = hn::IfThenElse(lower, hn::CopySign(one - hn::Abs(py), px), px);
  const Real<D> y = hn::IfThenElse(lower, hn::CopySign(one - hn::Abs(px), py), py);
  const auto quantise = [&](Real<D> v) HWY_ATTR {
    const Real<D> scaled = hn::MulAdd(v, Splat(d, 32767), Splat(d, 32768));
    return hn::BitCast(UintTag<D>(),
                       hn::NearestInt(hn::Min(hn::Max(scaled, hn::Zero(d)), Splat(d, 65535))));
  };
  return hn::Or(quantise(x), hn::ShiftLeft<16>(quantise(y)));
}
template <class D>
HWY_INLINE Vec3<D> DecodeNormal(D d, Uint<D> bits) {
  const IntTag<D> di;
  const UintTag<D> du;
  const auto expand = [&](Uint<D> v) HWY_ATTR {
    const Real<D> r = hn::ConvertTo(d, hn::BitCast(di, v));
    return (r - Splat(d, 32768)) * Splat(d, 1.0 / 32767);
  };
  const Real<D> x = expand(hn::And(bits, hn::Set(du, 0xffffu)));
  const Real<D> y = expand(hn::ShiftRight<16>(bits));
  const Real<D> z = Splat(d, 1) - hn::Abs(x) - hn::Abs(y);
  const Real<D> fold = hn::Max(hn::Neg(z), hn::Zero(d));
  const Vec3<D> n = {x - hn::CopySign(fold, x), y - hn::CopySign(fold, y), z};
  return Normalize(d, n);
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
