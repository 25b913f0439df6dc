// Texture look-up: one filtered RGBA sample per lane, each lane from its own texture slot.
//
// Per-target header (see lanes-inl.h). The rules it follows:
//  - texel centres are at half-integers and v = 0 is the top row; level l is texel-exact with
//  `Texture`;
//  - wrapping happens in UV, before the size is multiplied in, so that UV = 1e6 costs no precision
//    beyond the float's own; a NaN, infinite or larger than 1e9 coordinate reads as 0;
//  - the level of detail is log2_footprint + log2(sqrt(width x height x |det transform|)):
//  footprints are
//    isotropic, so the area decides. Between levels one is *chosen* at random with the fractional
//    part as probability, which averages to trilinear filtering at half the reads;
//  - colours are decoded before they are filtered; 8 and 16 bit texels give [0, 1].

#if defined(CARPOOL_STAGES_KERNELS_TEXTURE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_TEXTURE_INL_H_
#undef CARPOOL_STAGES_KERNELS_TEXTURE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_TEXTURE_INL_H_
#endif

#include <cstddef>
#include <cstdint>

#include "stages/simd/lanes-inl.h"
#include "stages/tables/texture_view.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

template <class D>
struct Rgba {
  Vec3<D> rgb;
  Real<D> a;
};

namespace texture_detail {

template <class D>
HWY_INLINE Mask<D> HasFlag(D d, Int<D> flags, int32_t flag) {
  const IntTag<D> di;
  const Int<D> bit = hn::Set(di, flag);
  return hn::RebindMask(d, hn::Eq(hn::And(flags, bit), bit));
}
template <class D>
HWY_INLINE Mask<D> IsEqual(D d, Int<D> value, int32_t other) {
  return hn::RebindMask(d, hn::Eq(value, hn::Set(IntTag<D>(), other)));
}

/// Reads fields of one record per lane. Most batches use one material, so that all lanes want the
/// same record: then a field is one scalar load instead of a gather.
template <class Record, class D>
class RecordReader {
 public:
  /// `index` is valid in every lane; `first` is one of them; `same` says that all equal it.
  RecordReader(const Record* base, Int<D> index, int32_t first, bool same)
      : base_(base), index_(index), first_(first), same_(hn::MaxLanes(D()) == 1 || same) {}

  HWY_INLINE Int<D> IntAt(size_t offset) const {
    if (!same_) return FieldInt(D(), base_, index_, offset);
    return hn::Set(IntTag<D>(), reinterpret_cast<const int32_t*>(base_ + first_)[offset / 4]);
  }
  HWY_INLINE Real<D> RealAt(size_t offset) const {
    if (!same_) return FieldReal(D(), base_, index_, offset);
    return hn::Set(D(), reinterpret_cast<const float*>(base_ + first_)[offset / 4]);
  }
  int32_t first() const { return first_; }
  bool same() const { return same_; }

 private:
  const Record* base_;
  Int<D> index_;
  int32_t first_;
  bool same_;
};

/// log2 of a positive normal float, within 2e-5; exact for powers of two.
template <class D>
HWY_INLINE Real<D> FastLog2(D d, Real<D> x) {
  const IntTag<D> di;
  const Int<D> bits = hn::BitCast(di, x);
  const Real<D> exponent = hn::ConvertTo(d, hn::ShiftRight<23>(bits) - hn::Set(di, 127));
  const Int<D> mantissa = hn::Or(hn::And(bits, hn::Set(di, 0x7fffff)), hn::Set(di, 0x3f800000));
  const Real<D> t = hn::BitCast(d, mantissa) - Splat(d, 1);
  Real<D> q = Splat(d, 0.0451482938);  // t * q(t) ~ log2(1 + t), q(1) = 1
  q = hn::MulAdd(q, t, Splat(d, -0.193573782));
  q = hn::MulAdd(q, t, Splat(d, 0.41560437));
  q = hn::MulAdd(q, t, Splat(d, -0.709095857));
  q = hn::MulAdd(q, t, Splat(d, 1.441916975));
  return hn::MulAdd(t, q, exponent);
}

/// The coordinate brought into [0, 1] by the wrap mode.
template <class D>
HWY_INLINE Real<D> WrapUnit(D d, Real<D> u, Int<D> mode) {
  const Real<D> one = Splat(d, 1);
  const Real<D> repeat = u - hn::Floor(u);  // exact, but 1 for tiny negative u
  const Real<D> clamp = hn::Min(hn::Max(u, hn::Zero(d)), one);
  const Real<D> period = u - Splat(d, 2) * hn::Floor(u * Splat(d, 0.5));
  const Real<D> mirror = hn::Min(period, Splat(d, 2) - period);
  return hn::IfThenElse(IsEqual(d, mode, kWrapRepeat), repeat,
                        hn::IfThenElse(IsEqual(d, mode, kWrapMirror), mirror, clamp));
}

/// The two texels of one axis and the weight of the second.
template <class D>
struct Axis {
  Int<D> low, high;
  Real<D> weight;
};

/// Neighbours outside the image are its other end when repeating, else the edge texel, which is
/// also what a mirror shows. Nearest lanes get weight 0.
template <class D>
HWY_INLINE Axis<D> ResolveAxis(D d, Real<D> unit, Real<D> size, Mask<D> repeat, Mask<D> nearest) {
  const IntTag<D> di;
  const Real<D> last = size - Splat(d, 1);
  const Real<D> x = unit * size;
  const Real<D> position = hn::IfThenElse(nearest, hn::Min(hn::Floor(x), last), x - Splat(d, 0.5));
  const Real<D> low = hn::Floor(position);  // -1 .. size - 1
  const Real<D> high = low + Splat(d, 1);   // 0 .. size
  const Real<D> before = hn::IfThenElseZero(repeat, last);
  const Real<D> after = hn::IfThenZeroElse(repeat, last);
  return {hn::ConvertTo(di, hn::IfThenElse(hn::Lt(low, hn::Zero(d)), before, low)),
          hn::ConvertTo(di, hn::IfThenElse(hn::Gt(high, last), after, high)), position - low};
}

/// How the texels of each lane are stored, with what the whole vector has in common.
template <class D>
struct Encoding {
  Mask<D> wide, srgb8, srgb16;
  Real<D> scale;  // integer code to [0, 1]
  bool any_wide, any_srgb8, any_srgb16;
};
template <class D>
HWY_INLINE Encoding<D> MakeEncoding(D d, Int<D> format, Int<D> srgb_flag) {
  const Mask<D> wide = IsEqual(d, format, static_cast<int32_t>(TexelFormat::rgba16));
  const Mask<D> srgb = hn::Not(IsEqual(d, srgb_flag, 0));
  const Mask<D> srgb8 = hn::AndNot(wide, srgb);
  const Mask<D> srgb16 = hn::And(wide, srgb);
  return {wide,
          srgb8,
          srgb16,
          hn::IfThenElse(wide, Splat(d, 1.0 / 65535), Splat(d, 1.0 / 255)),
          !hn::AllFalse(d, wide),
          !hn::AllFalse(d, srgb8),
          !hn::AllFalse(d, srgb16)};
}

template <class D>
HWY_INLINE Real<D> DecodeColor(D d, const TextureTablesView& t, const Encoding<D>& encoding,
                               Int<D> code) {
  const IntTag<D> di;
  Real<D> value = hn::ConvertTo(d, code) * encoding.scale;
  if (encoding.any_srgb8) {
    const Int<D> index = hn::IfThenElseZero(hn::RebindMask(di, encoding.srgb8), code);
    value = hn::IfThenElse(encoding.srgb8, GatherReal(d, t.srgb8, index), value);
  }
  if (encoding.any_srgb16) {
    const Int<D> index = hn::IfThenElseZero(hn::RebindMask(di, encoding.srgb16), code);
    value = hn::IfThenElse(encoding.srgb16, GatherReal(d, t.srgb16, index), value);
  }
  return value;
}

/// The decoded texel number `texel` of the level that starts at word `offset`.
template <class D>
HWY_INLINE Rgba<D> FetchTexel(D d, const TextureTablesView& t, const Encoding<D>& encoding,
                              Int<D> offset, Int<D> texel) {
  const IntTag<D> di;
  const auto wide = hn::RebindMask(di, encoding.wide);
  const Int<D> index = offset + texel + hn::IfThenElseZero(wide, texel);
  const Int<D> word = GatherInt(d, t.words, index);
  const Int<D> byte = hn::Set(di, 0xff);
  Int<D> r = hn::And(word, byte);
  Int<D> g = hn::And(hn::ShiftRight<8>(word), byte);
  Int<D> b = hn::And(hn::ShiftRight<16>(word), byte);
  Int<D> a = hn::And(hn::ShiftRight<24>(word), byte);
  if (encoding.any_wide) {
    const Int<D> half = hn::Set(di, 0xffff);
    const Int<D> second = GatherInt(d, t.words, index + hn::IfThenElseZero(wide, hn::Set(di, 1)));
    r = hn::IfThenElse(wide, hn::And(word, half), r);
    g = hn::IfThenElse(wide, hn::And(hn::ShiftRight<16>(word), half), g);
    b = hn::IfThenElse(wide, hn::And(second, half), b);
    a = hn::IfThenElse(wide, hn::And(hn::ShiftRight<16>(second), half), a);
  }
  return {{DecodeColor(d, t, encoding, r), DecodeColor(d, t, encoding, g),
           DecodeColor(d, t, encoding, b)},
          hn::ConvertTo(d, a) * encoding.scale};
}

/// a + weight (b - a): equal texels stay exactly equal.
template <class D>
HWY_INLINE Rgba<D> Lerp(const Rgba<D>& a, const Rgba<D>& b, Real<D> weight) {
  return {MulAdd(Sub(b.rgb, a.rgb), weight, a.rgb), hn::MulAdd(b.a - a.a, weight, a.a)};
}

/// UV after KHR_texture_transform and the log2 of the square root of the area factor it brings.
template <class D>
struct Coordinates {
  Real<D> u, v, area;
};
template <class D>
HWY_INLINE Coordinates<D> Transform(D d, const RecordReader<TextureSlot, D>& slot,
                                    const Vec2<D>& uv) {
  const Mask<D> moved = hn::Not(IsEqual(d, slot.IntAt(offsetof(TextureSlot, has_transform)), 0));
  Coordinates<D> at{uv.x, uv.y, Splat(d, 1)};
  if (!hn::AllFalse(d, moved)) {
    constexpr size_t kBase = offsetof(TextureSlot, transform);
    const Real<D> u_of_u = slot.RealAt(kBase), u_of_v = slot.RealAt(kBase + 4);
    const Real<D> v_of_u = slot.RealAt(kBase + 12), v_of_v = slot.RealAt(kBase + 16);
    const Real<D> u = hn::MulAdd(u_of_u, uv.x, hn::MulAdd(u_of_v, uv.y, slot.RealAt(kBase + 8)));
    const Real<D> v = hn::MulAdd(v_of_u, uv.x, hn::MulAdd(v_of_v, uv.y, slot.RealAt(kBase + 20)));
    at.u = hn::IfThenElse(moved, u, at.u);
    at.v = hn::IfThenElse(moved, v, at.v);
    at.area = hn::IfThenElse(moved, hn::Abs(u_of_u * v_of_v - u_of_v * v_of_u), at.area);
  }
  const Real<D> limit = Splat(d, 1e9);  // false for NaN: such a coordinate becomes 0
  at.u = hn::IfThenElseZero(hn::Le(hn::Abs(at.u), limit), at.u);
  at.v = hn::IfThenElseZero(hn::Le(hn::Abs(at.v), limit), at.v);
  return at;
}

/// Which level to read, and whether its nearest texel is taken alone.
template <class D>
struct Level {
  Real<D> number;
  Mask<D> nearest;
};
template <class D>
HWY_INLINE Level<D> ChooseLevel(D d, Int<D> filter, Real<D> lod, Real<D> last, Real<D> u_level) {
  const Mask<D> minified = hn::Gt(lod, hn::Zero(d));  // false for NaN
  const Real<D> bounded = hn::Min(hn::IfThenElseZero(minified, lod), last);
  const Real<D> low = hn::Floor(bounded);
  const Real<D> threshold =
      hn::IfThenElse(HasFlag(d, filter, kFilterMipNearest), Splat(d, 0.5), u_level);
  const Mask<D> up = hn::Lt(threshold, bounded - low);
  // The bound matters to inactive lanes, whose u_level may be anything.
  const Real<D> number = hn::Min(low + hn::IfThenElseZero(up, Splat(d, 1)), last);
  return {hn::IfThenElse(HasFlag(d, filter, kFilterMipNone), hn::Zero(d), number),
          hn::Or(hn::And(minified, HasFlag(d, filter, kFilterMinNearest)),
                 hn::AndNot(minified, HasFlag(d, filter, kFilterMagNearest)))};
}

/// The four texels around a point, blended; only the nearest one is read if no lane wants more.
template <class D>
HWY_INLINE Rgba<D> Filter(D d, const TextureTablesView& t, const Encoding<D>& encoding,
                          Int<D> offset, Int<D> width, const Axis<D>& x, const Axis<D>& y,
                          Mask<D> linear) {
  const Int<D> top = y.low * width;
  const Rgba<D> top_left = FetchTexel(d, t, encoding, offset, top + x.low);
  if (hn::AllFalse(d, linear)) return top_left;
  const Int<D> bottom = y.high * width;
  const Rgba<D> top_right = FetchTexel(d, t, encoding, offset, top + x.high);
  const Rgba<D> bottom_left = FetchTexel(d, t, encoding, offset, bottom + x.low);
  const Rgba<D> bottom_right = FetchTexel(d, t, encoding, offset, bottom + x.high);
  return Lerp(Lerp(top_left, top_right, x.weight), Lerp(bottom_left, bottom_right, x.weight),
              y.weight);
}

/// The sample of one vector whose `slot` is valid in every lane.
template <class D>
HWY_INLINE Rgba<D> Sample(D d, const TextureTablesView& t, const RecordReader<TextureSlot, D>& slot,
                          Mask<D> active, const Vec2<D>& uv, Real<D> log2_footprint,
                          Real<D> u_level) {
  const IntTag<D> di;
  const Int<D> id = slot.IntAt(offsetof(TextureSlot, texture));
  const RecordReader<Texture, D> texture(t.textures, id, t.slots[slot.first()].texture,
                                         slot.same());
  const Int<D> filter = slot.IntAt(offsetof(TextureSlot, filter));
  const Real<D> width0 = hn::ConvertTo(d, texture.IntAt(offsetof(Texture, width)));
  const Real<D> height0 = hn::ConvertTo(d, texture.IntAt(offsetof(Texture, height)));
  const Real<D> last = hn::ConvertTo(d, texture.IntAt(offsetof(Texture, levels)) - hn::Set(di, 1));

  const Coordinates<D> at = Transform(d, slot, uv);
  const Real<D> area = hn::Max(width0 * height0 * at.area, Splat(d, 1e-30));
  const Real<D> lod = hn::MulAdd(Splat(d, 0.5), FastLog2(d, area), log2_footprint);
  const Level<D> level = ChooseLevel(d, filter, lod, last, u_level);

  // 2^-level by its exponent bits: exact, and free of the per-lane shifts that SSE4 lacks.
  const Int<D> number = hn::ConvertTo(di, level.number);
  const Real<D> shrink = hn::BitCast(d, hn::ShiftLeft<23>(hn::Set(di, 127) - number));
  const Real<D> width = hn::Max(hn::Floor(width0 * shrink), Splat(d, 1));
  const Real<D> height = hn::Max(hn::Floor(height0 * shrink), Splat(d, 1));
  const Int<D> offset =
      GatherInt(d, t.textures,
                id * hn::Set(di, static_cast<int32_t>(sizeof(Texture) / 4)) + number +
                    hn::Set(di, static_cast<int32_t>(offsetof(Texture, level_offset) / 4)));

  const Int<D> wrap_s = slot.IntAt(offsetof(TextureSlot, wrap_s));
  const Int<D> wrap_t = slot.IntAt(offsetof(TextureSlot, wrap_t));
  const Axis<D> x = ResolveAxis(d, WrapUnit(d, at.u, wrap_s), width,
                                IsEqual(d, wrap_s, kWrapRepeat), level.nearest);
  const Axis<D> y = ResolveAxis(d, WrapUnit(d, at.v, wrap_t), height,
                                IsEqual(d, wrap_t, kWrapRepeat), level.nearest);
  const Encoding<D> encoding = MakeEncoding(d, texture.IntAt(offsetof(Texture, format)),
                                            texture.IntAt(offsetof(Texture, srgb)));
  return Filter(d, t, encoding, offset, hn::ConvertTo(di, width), x, y,
                hn::AndNot(level.nearest, active));
}

}  // namespace texture_detail

/// Samples texture slot `slot` at `uv`. `log2_footprint` is the log2 of the width of the ray cone's
/// footprint in UV units, before the slot's transform and the texture's size; `u_level` in [0, 1)
/// chooses between two mip levels. Active lanes need a slot whose texture exists; the others get
/// unspecified finite values.
template <class D>
HWY_NOINLINE Rgba<D> SampleTexture(D d, const TextureTablesView& t, Int<D> slot, Mask<D> active,
                                   const Vec2<D>& uv, Real<D> log2_footprint, Real<D> u_level) {
  const IntTag<D> di;
  const intptr_t lane = hn::FindFirstTrue(d, active);
  if (lane < 0) return {Splat3(d, 0, 0, 0), hn::Zero(d)};
  const int32_t first = hn::ExtractLane(slot, static_cast<size_t>(lane));
  // Inactive lanes read what an active one reads, so that every gather is in range.
  const Int<D> valid = hn::IfThenElse(hn::RebindMask(di, active), slot, hn::Set(di, first));
  const bool same = hn::AllTrue(di, hn::Eq(valid, hn::Set(di, first)));
  const texture_detail::RecordReader<TextureSlot, D> reader(t.slots, valid, first, same);
  return texture_detail::Sample(d, t, reader, active, uv, log2_footprint, u_level);
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
