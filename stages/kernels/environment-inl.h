// The environment map: radiance along a direction, and directions drawn in proportion to it.
//
// The density of `SampleEnvironment` over the map is exactly the bilinear interpolation of the
// texels' selection probabilities: a texel is chosen by inverting integer tables, then a place
// under its tent, the triangle function that bilinear interpolation gives it. Lookup and density
// read the same four texels with the same weights, so a direction with radiance has a density.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_ENVIRONMENT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_ENVIRONMENT_INL_H_
#undef CARPOOL_STAGES_KERNELS_ENVIRONMENT_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_ENVIRONMENT_INL_H_
#endif

#include "stages/kernels/light_math-inl.h"
#include "stages/mutants.h"
#include "stages/simd/quads-inl.h"
#include "stages/tables/light_view.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace lights {

/// A place on the map: texel centres are at integers, the place at (i + fs, j + ft) with fs, ft in
/// [0, 1], i in [0, width) and j in [-1, height). `sin_theta` belongs to the direction and is kept
/// because it is more exact than what the place gives near the poles.
template <class D>
struct EnvironmentPlace {
  Int<D> i, j;
  Real<D> fs, ft;
  Real<D> sin_theta;
};

template <class D>
struct EnvironmentValue {
  Vec3<D> radiance;
  Real<D> pdf;  // per solid angle; 0 where the map selects nothing
};

template <class D>
struct EnvironmentSample {
  Vec3<D> dir, radiance;
  Real<D> pdf;  // 0: no sample
};

/// Four texels (offsets into `EnvironmentView::texels`) and their bilinear weights.
template <class D>
struct EnvironmentTaps {
  Int<D> at00, at10, at01, at11;
  Real<D> w00, w10, w01, w11;
};

/// floor(x) as an integer, and what is left of x.
template <class D>
HWY_INLINE Int<D> SplitFloor(D, Real<D> x, Real<D>& fraction) {
  const Real<D> floor = hn::Floor(x);
  fraction = x - floor;
  return hn::ConvertTo(IntTag<D>(), floor);
}
template <class D>
HWY_INLINE Int<D> ClampIndex(D, Int<D> index, int32_t count) {
  const IntTag<D> di;
  return hn::Min(hn::Max(index, hn::Zero(di)), hn::Set(di, count - 1));
}
/// Column -1 is the last one; the clamp is for directions that are no numbers.
template <class D>
HWY_INLINE Int<D> WrapColumn(D d, Int<D> i, int32_t width) {
  const IntTag<D> di;
  const Int<D> wrapped = hn::IfThenElse(hn::Lt(i, hn::Zero(di)), i + hn::Set(di, width), i);
  return ClampIndex(d, wrapped, width);
}

template <class D>
HWY_INLINE EnvironmentPlace<D> PlaceOfDirection(D d, const EnvironmentView& view,
                                                const Vec3<D>& dir) {
  const Real<D> half = Splat(d, IsMutant(Mutant::shifted_sky) ? 0 : 0.5);
  EnvironmentPlace<D> place;
  place.sin_theta = SafeSqrt(d, hn::MulAdd(dir.x, dir.x, dir.z * dir.z));
  const Real<D> u =
      hn::MulAdd(AngleOf(d, dir.x, hn::Neg(dir.z)), Splat(d, 0.5 / kPi), Splat(d, 0.5));
  const Real<D> v = AngleOf(d, place.sin_theta, dir.y) * Splat(d, 1 / kPi);
  const Int<D> i = SplitFloor(d, hn::MulSub(u, Splat(d, view.width), half), place.fs);
  place.i = WrapColumn(d, i, view.width);
  place.j = SplitFloor(d, hn::MulSub(v, Splat(d, view.height), half), place.ft);
  return place;
}

template <class D>
HWY_INLINE EnvironmentTaps<D> TapsAt(D d, const EnvironmentView& view,
                                     const EnvironmentPlace<D>& place) {
  const IntTag<D> di;
  const Int<D> one = hn::Set(di, 1), width = hn::Set(di, view.width);
  const Int<D> next = place.i + one;
  const Int<D> i1 = hn::IfThenElseZero(hn::Lt(next, width), next);
  const Int<D> row0 = ClampIndex(d, place.j, view.height) * width;
  const Int<D> row1 = ClampIndex(d, place.j + one, view.height) * width;

  const Real<D> fs = place.fs, ft = place.ft;
  const Real<D> gs = Splat(d, 1) - fs, gt = Splat(d, 1) - ft;
  return {hn::ShiftLeft<2>(row0 + place.i),
          hn::ShiftLeft<2>(row0 + i1),
          hn::ShiftLeft<2>(row1 + place.i),
          hn::ShiftLeft<2>(row1 + i1),
          gs * gt,
          fs * gt,
          gs * ft,
          fs * ft};
}

/// The bilinear value of all four channels of the texels: radiance, and selection probability in w.
template <class D>
HWY_INLINE Quad<D> Interpolate(D d, const EnvironmentView& view, const EnvironmentTaps<D>& taps) {
  const Quad<D> a = GatherQuad(d, view.texels, taps.at00),
                b = GatherQuad(d, view.texels, taps.at10),
                c = GatherQuad(d, view.texels, taps.at01),
                e = GatherQuad(d, view.texels, taps.at11);
  const auto blend = [&](Real<D> a, Real<D> b, Real<D> c, Real<D> e) HWY_ATTR {
    return hn::MulAdd(taps.w00, a, hn::MulAdd(taps.w10, b, hn::MulAdd(taps.w01, c, taps.w11 * e)));
  };
  return {blend(a.x, b.x, c.x, e.x), blend(a.y, b.y, c.y, e.y), blend(a.z, b.z, c.z, e.z),
          blend(a.w, b.w, c.w, e.w)};
}
/// d(u, v) covers 2 pi^2 sin(theta) of solid angle. The floor only spares the very poles a 1/0.
template <class D>
HWY_INLINE EnvironmentValue<D> ValueAt(D d, const EnvironmentView& view,
                                       const EnvironmentPlace<D>& place) {
  const Quad<D> value = Interpolate(d, view, TapsAt(d, view, place));
  const double texels = static_cast<double>(view.width) * view.height;
  const Real<D> pdf =
      value.w * Splat(d, texels / (2 * kPi * kPi)) / hn::Max(place.sin_theta, Splat(d, 1e-7));
  return {{value.x, value.y, value.z}, pdf};
}

/// Both radiance and density, for the price of one look-up.
template <class D>
HWY_INLINE EnvironmentValue<D> LookUpEnvironment(D d, const EnvironmentView& view,
                                                 const Vec3<D>& dir) {
  if (view.width == 0) return {Splat3(d, 0, 0, 0), hn::Zero(d)};
  return ValueAt(d, view, PlaceOfDirection(d, view, dir));
}

/// Radiance that arrives from `dir`, which has unit length.
template <class D>
HWY_INLINE Vec3<D> EnvironmentRadiance(D d, const EnvironmentView& view, const Vec3<D>& dir) {
  return LookUpEnvironment(d, view, dir).radiance;
}

/// Density per solid angle with which `SampleEnvironment` returns `dir`.
template <class D>
HWY_INLINE Real<D> EnvironmentPdf(D d, const EnvironmentView& view, const Vec3<D>& dir) {
  return LookUpEnvironment(d, view, dir).pdf;
}

/// An entry of a cumulative table, and where within the entry's mass the number fell: in (0, 1).
template <class D>
struct TableEntry {
  Int<D> index;
  Real<D> within;
};

/// Many tables of `count` entries each, one behind the other, and their guides.
struct SelectionTables {
  const int32_t* HWY_RESTRICT cdf;
  const int32_t* HWY_RESTRICT guide;
  int32_t count;
};

/// u in units of mass.
template <class D>
HWY_INLINE Int<D> CellOf(D d, Real<D> u) {
  const Real<D> clamped = hn::Min(hn::Max(u, hn::Zero(d)), Splat(d, kLargestBelowOne));
  return hn::ConvertTo(IntTag<D>(), clamped * Splat(d, kEnvironmentMass));
}
/// Where the guide has that cell of table `which`.
template <class D>
HWY_INLINE Int<D> GuideOf(D, const SelectionTables& tables, Int<D> which, Int<D> cell) {
  return which * hn::Set(IntTag<D>(), GuideSize(tables.count)) +
         hn::ShiftRightSame(cell, 24 - GuideBits(tables.count));
}

/// Where the guide has the search for u begin: an entry of table `which`.
template <class D>
HWY_INLINE Int<D> GuidedEntry(D d, const SelectionTables& tables, Int<D> which, Real<D> u) {
  return GatherInt(d, tables.guide, GuideOf(d, tables, which, CellOf(d, u)));
}
/// Where the masses of table `which` begin.
template <class D>
HWY_INLINE Int<D> MassesOf(D, const SelectionTables& tables, Int<D> which) {
  return which * hn::Set(IntTag<D>(), tables.count + 1);
}

/// The last entry of table `which` whose cumulative mass is not above u's cell: entries without
/// mass share their successor's (or the end's) and are never the last. `low`: GuidedEntry.
template <class D>
HWY_INLINE TableEntry<D> InvertTable(D d, const SelectionTables& tables, Int<D> which, Real<D> u,
                                     Int<D> low) {
  const IntTag<D> di;
  const Int<D> one = hn::Set(di, 1);
  const Int<D> cell = CellOf(d, u);
  const Int<D> cdf = MassesOf(d, tables, which);

  // One load brings the bounds of three entries. What follows the end of a table is not looked at:
  // the end itself is above every cell.
  const IntQuad<D> bounds = GatherIntQuad(d, tables.cdf, cdf + low);
  const auto first = hn::Gt(bounds.y, cell);
  const auto second = hn::Or(first, hn::Gt(bounds.z, cell));
  const auto third = hn::Or(second, hn::Gt(bounds.w, cell));
  Int<D> begin = hn::IfThenElse(first, bounds.x, hn::IfThenElse(second, bounds.y, bounds.z));
  Int<D> end = hn::IfThenElse(first, bounds.y, hn::IfThenElse(second, bounds.z, bounds.w));
  low = low + hn::IfThenZeroElse(first, one) + hn::IfThenZeroElse(second, one);
  if (!hn::AllTrue(di, third)) {
    low = low + hn::IfThenZeroElse(third, one);
    const Int<D> guide = GuideOf(d, tables, which, cell);
    Int<D> high = hn::IfThenElse(third, low, GatherInt(d, tables.guide, guide + one));
    for (auto open = hn::Lt(low, high); !hn::AllFalse(di, open); open = hn::Lt(low, high)) {
      const Int<D> middle = hn::ShiftRight<1>(low + high + one);
      const auto above = hn::Gt(GatherInt(d, tables.cdf, cdf + middle), cell);
      low = hn::IfThenElse(hn::AndNot(above, open), middle, low);
      high = hn::IfThenElse(hn::And(above, open), middle - one, high);
    }
    const IntPair<D> mass = GatherIntPair(d, tables.cdf, cdf + low);
    begin = mass.x;
    end = mass.y;
  }
  // The middle of u's cell, so that an entry of a single cell is met at its centre.
  const Real<D> offset = hn::ConvertTo(d, cell - begin) + Splat(d, 0.5);
  const Real<D> within = SafeDiv(d, offset, hn::ConvertTo(d, end - begin));
  return {low, hn::Min(within, Splat(d, kLargestBelowOne))};
}

/// Inverts the triangle distribution on (-1, 1), monotonically.
template <class D>
HWY_INLINE Real<D> SampleTent(D d, Real<D> u) {
  const Real<D> one = Splat(d, 1), two = Splat(d, 2);
  const Mask<D> rising = hn::Lt(u, Splat(d, 0.5));
  const Real<D> root = SafeSqrt(d, two * hn::IfThenElse(rising, u, one - u));
  return hn::IfThenElse(rising, root - one, one - root);
}

/// A place under the tent of `texel`: the texel before the place, and how far it is behind it. Kept
/// apart, because their sum would round a place near the edge of the tent onto it, where the
/// density is 0.
template <class D>
HWY_INLINE Int<D> PlaceUnderTent(D d, const TableEntry<D>& texel, Real<D>& fraction) {
  const IntTag<D> di;
  const Real<D> offset = SampleTent(d, texel.within);
  const Mask<D> before = hn::Lt(offset, hn::Zero(d));
  fraction = hn::IfThenElse(before, offset + Splat(d, 1), offset);
  return hn::IfThenElse(ToIntMask(d, before), texel.index - hn::Set(di, 1), texel.index);
}

/// Distance in rows to the nearer pole, from that side, so that its sine keeps its relative
/// precision.
template <class D>
HWY_INLINE Real<D> RowsFromPole(D d, const EnvironmentView& view,
                                const EnvironmentPlace<D>& place) {
  const Int<D> below = hn::Set(IntTag<D>(), view.height - 1) - place.j;
  const Real<D> north = hn::ConvertTo(d, place.j) + Splat(d, 0.5) + place.ft;
  const Real<D> south = hn::ConvertTo(d, below) + (Splat(d, 0.5) - place.ft);
  return hn::Max(hn::Min(north, south), hn::Zero(d));
}

/// Asks for the cache line of base[index] of each lane.
template <class D, class T>
HWY_INLINE void PrefetchEach(D, const T* base, Int<D> index) {
  HWY_ALIGN int32_t at[hn::MaxLanes(D())];
  hn::Store(index, IntTag<D>(), at);
  for (const int32_t i : at) __builtin_prefetch(base + i);
}

/// A place on the map being drawn. Its four steps each begin with look-ups all over a large table;
/// what a step will read is asked for at the end of the one before, so that other lanes can go
/// through theirs meanwhile.
template <class D>
struct EnvironmentSearch {
  TableEntry<D> row;          // of the first step
  Int<D> column;              // of the second: where the search for it begins
  EnvironmentPlace<D> place;  // of the third
};

template <class D>
HWY_INLINE SelectionTables ColumnsOf(D, const EnvironmentView& view) {
  return {view.column_cdf, view.column_guide, view.width};
}

template <class D>
HWY_INLINE void FindRow(D d, const EnvironmentView& view, const Vec2<D>& u,
                        EnvironmentSearch<D>& search) {
  const SelectionTables rows = {view.row_cdf, view.row_guide, view.height};
  const SelectionTables columns = ColumnsOf(d, view);
  const Int<D> only = hn::Zero(IntTag<D>());
  search.row = InvertTable(d, rows, only, u.y, GuidedEntry(d, rows, only, u.y));
  PrefetchEach(d, columns.guide, GuideOf(d, columns, search.row.index, CellOf(d, u.x)));
}

template <class D>
HWY_INLINE void FindColumn(D d, const EnvironmentView& view, const Vec2<D>& u,
                           EnvironmentSearch<D>& search) {
  const SelectionTables columns = ColumnsOf(d, view);
  search.column = GuidedEntry(d, columns, search.row.index, u.x);
  PrefetchEach(d, columns.cdf, MassesOf(d, columns, search.row.index) + search.column);
}

/// A place with the density described above: tents are wrapped in s and reflected at the poles,
/// which is what wrapping and clamping make of bilinear interpolation.
template <class D>
HWY_INLINE void FindPlace(D d, const EnvironmentView& view, const Vec2<D>& u,
                          EnvironmentSearch<D>& search) {
  const IntTag<D> di;
  const TableEntry<D>& row = search.row;
  const TableEntry<D> column = InvertTable(d, ColumnsOf(d, view), row.index, u.x, search.column);
  EnvironmentPlace<D>& place = search.place;
  place.i = WrapColumn(d, PlaceUnderTent(d, column, place.fs), view.width);
  place.j = PlaceUnderTent(d, row, place.ft);
  const EnvironmentTaps<D> taps = TapsAt(d, view, place);
  PrefetchEach(d, view.texels, taps.at00);
  PrefetchEach(d, view.texels, taps.at01);

  const Real<D> half = Splat(d, 0.5);
  const Mask<D> north = ToMask(d, hn::Lt(place.j, hn::Zero(di)));
  const Mask<D> south = ToMask(d, hn::Eq(place.j, hn::Set(di, view.height - 1)));
  const Mask<D> beyond =
      hn::Or(hn::And(north, hn::Lt(place.ft, half)), hn::And(south, hn::Gt(place.ft, half)));
  place.ft = hn::IfThenElse(beyond, Splat(d, 1) - place.ft, place.ft);
  place.sin_theta = AcuteSine(d, RowsFromPole(d, view, place) * Splat(d, kPi / view.height));
}

template <class D>
HWY_INLINE Vec3<D> DirectionOfPlace(D d, const EnvironmentView& view,
                                    const EnvironmentPlace<D>& place) {
  const auto angle = [&](Int<D> whole, Real<D> fraction, int32_t count, double circle) HWY_ATTR {
    const Real<D> from_middle = hn::ConvertTo(d, whole) - Splat(d, 0.5 * count - 0.5);
    return (from_middle + fraction) * Splat(d, circle / count);
  };
  const Real<D> phi = angle(place.i, place.fs, view.width, 2 * kPi);
  const Real<D> wrapped = hn::IfThenElse(hn::Gt(phi, Splat(d, kPi)), phi - Splat(d, 2 * kPi), phi);
  const Angle<D> azimuth = AngleFromRadians(d, wrapped);
  const Real<D> depression = angle(place.j, place.ft, view.height, kPi);
  return {place.sin_theta * azimuth.sin, hn::Neg(AcuteSine(d, depression)),
          hn::Neg(place.sin_theta * azimuth.cos)};
}

/// A direction drawn in proportion to the map's luminance x sin(theta), bilinear like the map:
/// the last step.
template <class D>
HWY_INLINE EnvironmentSample<D> SampleFound(D d, const EnvironmentView& view,
                                            const EnvironmentSearch<D>& search) {
  const EnvironmentValue<D> value = ValueAt(d, view, search.place);
  return {DirectionOfPlace(d, view, search.place), value.radiance, value.pdf};
}

/// All four steps.
template <class D>
HWY_INLINE EnvironmentSample<D> SampleEnvironment(D d, const EnvironmentView& view,
                                                  const Vec2<D>& u) {
  if (view.width == 0) return {Splat3(d, 0, 1, 0), Splat3(d, 0, 0, 0), hn::Zero(d)};
  EnvironmentSearch<D> search;
  FindRow(d, view, u, search);
  FindColumn(d, view, u, search);
  FindPlace(d, view, u, search);
  return SampleFound(d, view, search);
}

}  // namespace lights

using lights::EnvironmentPdf;
using lights::EnvironmentRadiance;
using lights::EnvironmentSample;
using lights::EnvironmentValue;
using lights::LookUpEnvironment;
using lights::SampleEnvironment;

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
