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

#include "stages/mutants.h"
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

// Most batches use one material, so that all lanes want the same slot. Then its fields are plain
// int32_t and what follows from them plain bool, and code branches; otherwise they are Int<D> and
// Mask<D>, and code blends. The overloads below let one source serve both, with the same bits in
// every lane.

template <class D>
HWY_INLINE bool Test(D, int32_t field, int32_t value) {
  return field == value;
}
template <class D>
HWY_INLINE Mask<D> Test(D d, Int<D> field, int32_t value) {
  return hn::RebindMask(d, hn::Eq(field, hn::Set(IntTag<D>(), value)));
}
template <class D>
HWY_INLINE bool HasFlag(D, int32_t flags, int32_t flag) {
  return (flags & flag) != 0;
}
template <class D>
HWY_INLINE Mask<D> HasFlag(D d, Int<D> flags, int32_t flag) {
  return Test(d, hn::And(flags, hn::Set(IntTag<D>(), flag)), flag);
}
HWY_INLINE bool Inverse(bool a) {
  return !a;
}
template <class M>
HWY_INLINE M Inverse(M a) {
  return hn::Not(a);
}
HWY_INLINE bool Both(bool a, bool b) {
  return a && b;
}
template <class M>
HWY_INLINE M Both(M a, M b) {
  return hn::And(a, b);
}
template <class D>
HWY_INLINE bool Any(D, bool condition) {
  return condition;
}
template <class D>
HWY_INLINE bool Any(D d, Mask<D> condition) {
  return !hn::AllFalse(d, condition);
}
template <class D>
HWY_INLINE bool All(D, bool condition) {
  return condition;
}
template <class D>
HWY_INLINE bool All(D d, Mask<D> condition) {
  return hn::AllTrue(d, condition);
}
/// `yes()` or `no()`, each a Real or Int: only what is needed is evaluated.
template <class D, class Yes, class No>
HWY_INLINE auto Choose(D, bool condition, const Yes& yes, const No& no) {
  return condition ? yes() : no();
}
template <class D, class Yes, class No>
HWY_INLINE auto Choose(D, Mask<D> condition, const Yes& yes, const No& no) {
  const auto chosen = yes();
  const hn::DFromV<decltype(no())> tag;
  return hn::IfThenElse(hn::RebindMask(tag, condition), chosen, no());
}
template <class D>
HWY_INLINE Real<D> ToReal(D d, int32_t field) {
  return Broadcast(d, static_cast<float>(field));
}
template <class D>
HWY_INLINE Real<D> ToReal(D d, Int<D> field) {
  return hn::ConvertTo(d, field);
}

/// Reads fields of the record that all lanes share.
template <class Record, class D>
class SharedRecord {
 public:
  explicit SharedRecord(const Record* record) : record_(record) {}
  HWY_INLINE int32_t IntAt(size_t offset) const {
    return reinterpret_cast<const int32_t*>(record_)[offset / 4];
  }
  HWY_INLINE Real<D> RealAt(size_t offset) const {
    return Broadcast(D(), reinterpret_cast<const float*>(record_)[offset / 4]);
  }
  /// Word `index` of an array of words in the record.
  HWY_INLINE Int<D> WordAt(size_t offset, Int<D> index) const {
    return GatherInt(D(), reinterpret_cast<const int32_t*>(record_) + offset / 4, index);
  }

 private:
  const Record* record_;
};

/// Reads fields of one record per lane.
template <class Record, class D>
class LaneRecords {
 public:
  LaneRecords(const Record* base, Int<D> index) : base_(base), index_(index) {}
  HWY_INLINE Int<D> IntAt(size_t offset) const { return FieldInt(D(), base_, index_, offset); }
  HWY_INLINE Real<D> RealAt(size_t offset) const { return FieldReal(D(), base_, index_, offset); }
  HWY_INLINE Int<D> WordAt(size_t offset, Int<D> index) const {
    const IntTag<D> di;
    return GatherInt(D(), base_,
                     index_ * hn::Set(di, static_cast<int32_t>(sizeof(Record) / 4)) +
                         hn::Set(di, static_cast<int32_t>(offset / 4)) + index);
  }

 private:
  const Record* base_;
  Int<D> index_;
};

/// The coordinate brought into [0, 1] by the wrap mode.
template <class D, class Field>
HWY_INLINE Real<D> WrapUnit(D d, Real<D> u, Field mode) {
  const auto repeat = [&] { return u - hn::Floor(u); };  // exact, but 1 for tiny negative u
  const auto clamp = [&] { return hn::Min(hn::Max(u, hn::Zero(d)), Splat(d, 1)); };
  const auto mirror = [&] {
    const Real<D> period = u - Splat(d, 2) * hn::Floor(u * Splat(d, 0.5));
    return hn::Min(period, Splat(d, 2) - period);
  };
  return Choose(d, Test(d, mode, kWrapRepeat), repeat,
                [&] { return Choose(d, Test(d, mode, kWrapMirror), mirror, clamp); });
}

/// Which lanes take their nearest texel alone, and whether there are any.
template <class D>
struct Nearest {
  Mask<D> mask;
  bool any;
};

/// The integer that `x`, integral in [0, 2^22], holds: by its bits, without the care that Highway's
/// conversion takes of values too large for an integer.
template <class D>
HWY_INLINE Int<D> ToTexel(D d, Real<D> x) {
  const IntTag<D> di;
  if constexpr (kReference<D>) return hn::ConvertTo(di, x);
  return hn::BitCast(di, x + Splat(d, 0x1p23)) - Broadcast(di, 0x4b000000);
}

/// The two texels of one axis and the weight of the second.
template <class D>
struct Axis {
  Int<D> low, high;
  Real<D> weight;
};

/// Neighbours outside the image are its other end when repeating, else the edge texel, which is
/// also what a mirror shows. Nearest lanes get weight 0.
template <class D, class Field>
HWY_INLINE Axis<D> ResolveAxis(D d, Real<D> u, Field wrap, Real<D> size,
                               const Nearest<D>& nearest) {
  const Real<D> zero = hn::Zero(d), last = size - Splat(d, 1);
  const Real<D> x = WrapUnit(d, u, wrap) * size;
  Real<D> position = x - Splat(d, IsMutant(Mutant::shifted_texel) ? 0 : 0.5);
  if (nearest.any) {
    position = hn::IfThenElse(nearest.mask, hn::Min(hn::Floor(x), last), position);
  }
  const Real<D> low = hn::Floor(position);  // -1 .. size - 1
  const Real<D> high = low + Splat(d, 1);   // 0 .. size
  const auto first_texel = [&] { return zero; };
  const auto last_texel = [&] { return last; };
  const auto repeat = Test(d, wrap, kWrapRepeat);
  const Real<D> before = Choose(d, repeat, last_texel, first_texel);
  const Real<D> after = Choose(d, repeat, first_texel, last_texel);
  return {ToTexel(d, hn::IfThenElse(hn::Lt(low, zero), before, low)),
          ToTexel(d, hn::IfThenElse(hn::Gt(high, last), after, high)), position - low};
}

/// How texels are stored; `Condition` is bool or Mask<D>.
template <class D, class Condition>
struct Encoding {
  Condition wide, srgb;
  Real<D> scale;  // integer code to [0, 1]
};
template <class D, class Field>
HWY_INLINE auto MakeEncoding(D d, Field format, Field srgb_flag) {
  auto wide = Test(d, format, static_cast<int32_t>(TexelFormat::rgba16));
  const Real<D> scale = Choose(
      d, wide, [&] { return Splat(d, 1.0 / 65535); }, [&] { return Splat(d, 1.0 / 255); });
  return Encoding<D, decltype(wide)>{wide, Inverse(Test(d, srgb_flag, 0)), scale};
}

/// Linear light of `code` where `condition` holds, else `value`; codes elsewhere may exceed the
/// table.
template <class D>
HWY_INLINE Real<D> LookUp(D d, const float* table, bool, Int<D> code, Real<D>) {
  return GatherReal(d, table, code);
}
template <class D>
HWY_INLINE Real<D> LookUp(D d, const float* table, Mask<D> condition, Int<D> code, Real<D> value) {
  const Int<D> index = hn::IfThenElseZero(hn::RebindMask(IntTag<D>(), condition), code);
  return hn::IfThenElse(condition, GatherReal(d, table, index), value);
}

template <class D, class Condition>
HWY_INLINE Real<D> DecodeColor(D d, const TextureTablesView& t,
                               const Encoding<D, Condition>& encoding, Int<D> code) {
  Real<D> value = hn::ConvertTo(d, code) * encoding.scale;
  const Condition srgb8 = Both(Inverse(encoding.wide), encoding.srgb);
  if (Any(d, srgb8)) value = LookUp(d, t.srgb8, srgb8, code, value);
  const Condition srgb16 = Both(encoding.wide, encoding.srgb);
  if (Any(d, srgb16)) value = LookUp(d, t.srgb16, srgb16, code, value);
  return value;
}

/// A texel as it is stored; `second` is there for 16 bits only.
template <class D>
struct TexelWords {
  Int<D> first, second;
};
/// Texel number `texel` of the level that starts at word `offset`.
template <class D, class Condition>
HWY_INLINE TexelWords<D> FetchTexel(D d, const TextureTablesView& t,
                                    const Encoding<D, Condition>& encoding, Int<D> offset,
                                    Int<D> texel) {
  const IntTag<D> di;
  const auto zero = [&] { return hn::Zero(di); };
  const auto one = [&] { return hn::Set(di, 1); };
  const Int<D> index = offset + texel +
                       Choose(
                           d, encoding.wide, [&] { return texel; }, zero);
  const Int<D> first = GatherInt(d, t.words, index);
  if (!Any(d, encoding.wide)) return {first, first};
  return {first, GatherInt(d, t.words, index + Choose(d, encoding.wide, one, zero))};
}

template <class D, class Condition>
HWY_INLINE Rgba<D> DecodeTexel(D d, const TextureTablesView& t,
                               const Encoding<D, Condition>& encoding, const TexelWords<D>& word) {
  const IntTag<D> di;
  const Int<D> byte = hn::Set(di, 0xff), half = hn::Set(di, 0xffff);
  const Condition wide = encoding.wide;
  const Int<D> r = Choose(
      d, wide, [&] { return hn::And(word.first, half); },
      [&] { return hn::And(word.first, byte); });
  const Int<D> g = Choose(
      d, wide, [&] { return hn::And(hn::ShiftRight<16>(word.first), half); },
      [&] { return hn::And(hn::ShiftRight<8>(word.first), byte); });
  const Int<D> b = Choose(
      d, wide, [&] { return hn::And(word.second, half); },
      [&] { return hn::And(hn::ShiftRight<16>(word.first), byte); });
  const Int<D> a = Choose(
      d, wide, [&] { return hn::And(hn::ShiftRight<16>(word.second), half); },
      [&] { return hn::And(hn::ShiftRight<24>(word.first), byte); });
  return {{DecodeColor(d, t, encoding, r), DecodeColor(d, t, encoding, g),
           DecodeColor(d, t, encoding, b)},
          hn::ConvertTo(d, a) * encoding.scale};
}

/// a + weight (b - a): equal texels stay exactly equal.
template <class D>
HWY_INLINE Rgba<D> Lerp(const Rgba<D>& a, const Rgba<D>& b, Real<D> weight) {
  return {MulAdd(Sub(b.rgb, a.rgb), weight, a.rgb), hn::MulAdd(b.a - a.a, weight, a.a)};
}

/// UV after KHR_texture_transform, and the factor by which it scales areas.
template <class D>
struct Coordinates {
  Real<D> u, v, area;
};
template <class D, class Slot>
HWY_INLINE Coordinates<D> Transform(D d, const Slot& slot, const Vec2<D>& uv) {
  const auto moved = Inverse(Test(d, slot.IntAt(offsetof(TextureSlot, has_transform)), 0));
  Coordinates<D> at{uv.x, uv.y, Splat(d, 1)};
  if (Any(d, moved)) {
    constexpr size_t kBase = offsetof(TextureSlot, transform);
    const Real<D> u_of_u = slot.RealAt(kBase), u_of_v = slot.RealAt(kBase + 4);
    const Real<D> v_of_u = slot.RealAt(kBase + 12), v_of_v = slot.RealAt(kBase + 16);
    const Real<D> u = hn::MulAdd(u_of_u, uv.x, hn::MulAdd(u_of_v, uv.y, slot.RealAt(kBase + 8)));
    const Real<D> v = hn::MulAdd(v_of_u, uv.x, hn::MulAdd(v_of_v, uv.y, slot.RealAt(kBase + 20)));
    const Real<D> area = hn::Abs(u_of_u * v_of_v - u_of_v * v_of_u);
    at.u = Choose(
        d, moved, [&] { return u; }, [&] { return uv.x; });
    at.v = Choose(
        d, moved, [&] { return v; }, [&] { return uv.y; });
    at.area = Choose(
        d, moved, [&] { return area; }, [&] { return Splat(d, 1); });
  }
  const Real<D> limit = Splat(d, 1e9);  // false for NaN: such a coordinate becomes 0
  at.u = hn::IfThenElseZero(hn::Le(hn::Abs(at.u), limit), at.u);
  at.v = hn::IfThenElseZero(hn::Le(hn::Abs(at.v), limit), at.v);
  return at;
}

/// Which level to read, and which lanes take its nearest texel alone.
template <class D>
struct Level {
  Real<D> number;
  Nearest<D> nearest;
};
template <class D, class Field>
HWY_INLINE Level<D> ChooseLevel(D d, Field filter, Real<D> lod, Real<D> last, Real<D> u_level) {
  const Mask<D> minified = hn::Gt(lod, hn::Zero(d));  // false for NaN
  const auto by_footprint = [&] {
    const Real<D> bounded = hn::Min(hn::IfThenElseZero(minified, lod), last);
    const Real<D> low = hn::Floor(bounded);
    const Real<D> threshold = Choose(
        d, HasFlag(d, filter, kFilterMipNearest), [&] { return Splat(d, 0.5); },
        [&] { return u_level; });
    const Mask<D> up = hn::Lt(threshold, bounded - low);
    // The bound matters to inactive lanes, whose u_level may be anything.
    return hn::Min(low + hn::IfThenElseZero(up, Splat(d, 1)), last);
  };
  const Real<D> number = Choose(
      d, HasFlag(d, filter, kFilterMipNone), [&] { return hn::Zero(d); }, by_footprint);

  const auto small = HasFlag(d, filter, kFilterMinNearest);
  const auto large = HasFlag(d, filter, kFilterMagNearest);
  if (!Any(d, small) && !Any(d, large)) return {number, {minified, false}};  // mask unused
  const auto one = [&] { return Splat(d, 1); };
  const auto zero = [&] { return hn::Zero(d); };
  const Real<D> nearest =
      hn::IfThenElse(minified, Choose(d, small, one, zero), Choose(d, large, one, zero));
  const Mask<D> mask = hn::Gt(nearest, hn::Zero(d));
  return {number, {mask, !hn::AllFalse(d, mask)}};
}

#ifndef CARPOOL_ONE_DOUBLE
/// A texel as four lanes, R first: what one path at a time makes of SIMD, with the same bits.
using Channels = hn::Vec<hn::FixedTag<float, 4>>;
template <class Code>
HWY_INLINE Channels DecodeChannels(const float* srgb, const Code* HWY_RESTRICT codes,
                                   double scale) {
  const hn::FixedTag<float, 4> df;
  if (srgb == nullptr) {
    const hn::FixedTag<Code, 4> dc;
    const hn::FixedTag<int32_t, 4> di;
    return hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(dc, codes))) * Splat(df, scale);
  }
  // Built in registers: four stores and a load of them all would stall.
  const hn::FixedTag<float, 1> d1;
  const hn::FixedTag<float, 2> d2;
  const float alpha = static_cast<float>(codes[3]) * static_cast<float>(scale);
  return hn::Combine(
      df, hn::Combine(d2, hn::LoadU(d1, &alpha), hn::LoadU(d1, srgb + codes[2])),
      hn::Combine(d2, hn::LoadU(d1, srgb + codes[1]), hn::LoadU(d1, srgb + codes[0])));
}

/// `Filter` for one lane.
template <class D>
HWY_INLINE Rgba<D> FilterOne(D d, const TextureTablesView& t, const Encoding<D, bool>& encoding,
                             Int<D> offset, Int<D> width, const Axis<D>& x, const Axis<D>& y,
                             bool nearest_only) {
  const hn::FixedTag<float, 4> df;
  const uint32_t* const level = t.words + hn::GetLane(offset);
  const int32_t left = hn::GetLane(x.low), right = hn::GetLane(x.high);
  const int32_t top = hn::GetLane(y.low) * hn::GetLane(width),
                bottom = hn::GetLane(y.high) * hn::GetLane(width);
  const float* const narrow_table = encoding.srgb ? t.srgb8 : nullptr;
  const float* const wide_table = encoding.srgb ? t.srgb16 : nullptr;
  const auto decode = [&](int32_t texel) {
    return encoding.wide
               ? DecodeChannels(wide_table, reinterpret_cast<const uint16_t*>(level + 2 * texel),
                                1.0 / 65535)
               : DecodeChannels(narrow_table, reinterpret_cast<const uint8_t*>(level + texel),
                                1.0 / 255);
  };
  const auto lerp = [&](Channels a, Channels b, Real<D> weight) {
    return hn::MulAdd(b - a, hn::Set(df, hn::GetLane(weight)), a);
  };
  Channels color = decode(top + left);
  if (!nearest_only) {
    const Channels above = lerp(color, decode(top + right), x.weight);
    const Channels below = lerp(decode(bottom + left), decode(bottom + right), x.weight);
    color = lerp(above, below, y.weight);
  }
  HWY_ALIGN float channel[4];
  hn::Store(color, df, channel);
  return {{hn::LoadU(d, channel), hn::LoadU(d, channel + 1), hn::LoadU(d, channel + 2)},
          hn::LoadU(d, channel + 3)};
}

#endif

/// The four texels around a point, blended; only the nearest one is read if no lane wants more. All
/// are fetched before any is decoded, so that their cache misses overlap.
template <class D, class Condition>
HWY_INLINE Rgba<D> Filter(D d, const TextureTablesView& t, const Encoding<D, Condition>& encoding,
                          Int<D> offset, Int<D> width, const Axis<D>& x, const Axis<D>& y,
                          bool nearest_only) {
  if constexpr (hn::MaxLanes(D()) == 1 && !kReference<D>) {
    return FilterOne(d, t, encoding, offset, width, x, y, nearest_only);
  } else {
    const auto fetch = [&](Int<D> texel) { return FetchTexel(d, t, encoding, offset, texel); };
    const auto decode = [&](const TexelWords<D>& words) {
      return DecodeTexel(d, t, encoding, words);
    };
    const Int<D> top = y.low * width;
    const TexelWords<D> top_left = fetch(top + x.low);
    if (nearest_only) return decode(top_left);
    const Int<D> bottom = y.high * width;
    const TexelWords<D> bottom_left = fetch(bottom + x.low);
    const TexelWords<D> top_right = fetch(top + x.high);
    const TexelWords<D> bottom_right = fetch(bottom + x.high);
    return Lerp(Lerp(decode(top_left), decode(top_right), x.weight),
                Lerp(decode(bottom_left), decode(bottom_right), x.weight), y.weight);
  }
}

/// 2^-level by its exponent bits: exact, and free of the per-lane shifts that SSE4 lacks.
template <class D>
HWY_INLINE Real<D> LevelScale(D d, Int<D> level) {
  if constexpr (kReference<D>) return hn::Set(d, std::ldexp(1.0, -hn::GetLane(level)));
  return hn::BitCast(d, hn::ShiftLeft<23>(Broadcast(IntTag<D>(), 127) - level));
}

/// The sample of one vector. `slot` and `texture` are records that exist in every lane.
template <class D, class Slot, class Image>
HWY_INLINE Rgba<D> Sample(D d, const TextureTablesView& t, const Slot& slot, const Image& texture,
                          Mask<D> active, const Vec2<D>& uv, Real<D> log2_footprint,
                          Real<D> u_level) {
  const Real<D> width0 = ToReal(d, texture.IntAt(offsetof(Texture, width)));
  const Real<D> height0 = ToReal(d, texture.IntAt(offsetof(Texture, height)));
  const Real<D> last = ToReal(d, texture.IntAt(offsetof(Texture, levels))) - Splat(d, 1);

  const Coordinates<D> at = Transform(d, slot, uv);
  const Real<D> area = hn::Max(width0 * height0 * at.area, Splat(d, 1e-30));
  const Real<D> lod = hn::MulAdd(Splat(d, 0.5), FastLog2(d, area), log2_footprint);
  const Level<D> level =
      ChooseLevel(d, slot.IntAt(offsetof(TextureSlot, filter)), lod, last, u_level);

  const Int<D> number = ToTexel(d, level.number);
  const Real<D> shrink = LevelScale(d, number);
  const Real<D> width = hn::Max(hn::Floor(width0 * shrink), Splat(d, 1));
  const Real<D> height = hn::Max(hn::Floor(height0 * shrink), Splat(d, 1));
  const Int<D> offset = texture.WordAt(offsetof(Texture, level_offset), number);

  const auto encoding = MakeEncoding(d, texture.IntAt(offsetof(Texture, format)),
                                     texture.IntAt(offsetof(Texture, srgb)));
  const Axis<D> x =
      ResolveAxis(d, at.u, slot.IntAt(offsetof(TextureSlot, wrap_s)), width, level.nearest);
  const Axis<D> y =
      ResolveAxis(d, at.v, slot.IntAt(offsetof(TextureSlot, wrap_t)), height, level.nearest);
  const bool nearest_only =
      level.nearest.any && hn::AllFalse(d, hn::AndNot(level.nearest.mask, active));
  return Filter(d, t, encoding, offset, ToTexel(d, width), x, y, nearest_only);
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
  using namespace texture_detail;
  if constexpr (hn::MaxLanes(D()) > 1) {
    // Inactive lanes read what an active one reads, so that every gather is in range.
    const Int<D> valid = hn::IfThenElse(hn::RebindMask(di, active), slot, hn::Set(di, first));
    if (!hn::AllTrue(di, hn::Eq(valid, hn::Set(di, first)))) {
      const LaneRecords<TextureSlot, D> slots(t.slots, valid);
      const LaneRecords<Texture, D> textures(t.textures,
                                             slots.IntAt(offsetof(TextureSlot, texture)));
      return Sample(d, t, slots, textures, active, uv, log2_footprint, u_level);
    }
  }
  const TextureSlot& shared = t.slots[first];
  return Sample(d, t, SharedRecord<TextureSlot, D>(&shared),
                SharedRecord<Texture, D>(t.textures + shared.texture), active, uv, log2_footprint,
                u_level);
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
