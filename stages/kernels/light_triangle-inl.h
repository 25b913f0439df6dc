// Samples a point of a triangle light as seen from a receiver, with densities per solid angle.
//
// Three methods, chosen by the solid angle of the triangle.
//
// Below kLeastSolidAngle: uniform over the area. Seen from afar its density is all but constant,
// and it needs no difference of nearly equal directions: a spherical triangle of edge e places its
// points with a relative error of about 2^-24 / e, 1e-5 at the switch.
//
// Above kGreatestSolidAngle: uniform over the hemisphere about the triangle's normal; a direction
// that passes the triangle gives no sample. The receiver is so close that few do, while the arcs of
// the spherical triangle are nearly half circles, whose planes rounding turns about.
//
// Between: uniform over the spherical triangle (Arvo 1995, "Stratified Sampling of Spherical
// Triangles"), in the form of Peters 2021, "BRDF Importance Sampling for Polygonal Lights": half
// angles and no angle sums, hence without the cancellation of alpha + beta + gamma - pi.
//
// None of them where the triangle is blurred (see kGreatestBlur): it is left to BSDF sampling.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_LIGHT_TRIANGLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_LIGHT_TRIANGLE_INL_H_
#undef CARPOOL_STAGES_KERNELS_LIGHT_TRIANGLE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_LIGHT_TRIANGLE_INL_H_
#endif

#include "stages/kernels/light_math-inl.h"
#include "stages/mutants.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace lights {

constexpr double kLeastSolidAngle = 3e-4;
constexpr double kGreatestSolidAngle = 6.2;

/// How far a ray's hit may be off the triangle's plane, relative to the distance of its farthest
/// vertex: Embree subtracts the origin from the vertices, which rounds them, and takes products of
/// the differences.
constexpr double kPlaneError = 0x1p-20;
/// Of a triangle so near to its own plane, relative to its size, that this share of the height over
/// the plane is rounding, it depends on chance which of several triangles a ray meets first: shadow
/// rays would be blocked, or pass, at random. Light sampling leaves it alone, and its density for
/// what BSDF sampling finds of it is 0. Hence MIS counts everything that rays meet just once.
constexpr double kGreatestBlur = 0x1p-6;

template <class D>
struct TriangleLightSample {
  Real<D> b1, b2;  // barycentrics of p1 and p2
  Vec3<D> wi;      // unit, from the receiver
  Real<D> distance;
  Real<D> blur;  // relative error of the distance at which rays find the triangle
  Real<D> pdf;   // per solid angle; 0: no sample
};

/// The triangle as the receiver sees it.
template <class D>
struct SphericalTriangle {
  Vec3<D> p0, p1, p2;   // vertices relative to the receiver
  Vec3<D> area_normal;  // twice the area, along the normal of the vertex order
  Real<D> triple;       // p0 . (p1 x p2) = area_normal . p0: < 0 in front of the triangle
  Vec3<D> a, b, c;      // unit directions to the vertices; a to c is the longest arc
  Real<D> one_plus_ab, ac, bc;
  Real<D> volume;  // |a . (b x c)|
  Real<D> blur;    // kPlaneError over the height, relative to the size
  Real<D> solid_angle;
  Mask<D> tiny, huge;  // which method samples it
};

/// Rotates the vertices so that the longest arc, whose ends have the least cosine, is opposite `b`.
/// Of arcs that are as good as equal it is the first: in a triangle that is symmetric, as the
/// receiver sees it, rounding must not decide which point belongs to which random numbers.
template <class D>
HWY_INLINE void PutLongestArcFirst(D d, const Real<D>& d01, const Real<D>& d12, const Real<D>& d20,
                                   Vec3<D>& a, Vec3<D>& b, Vec3<D>& c) {
  const Vec3<D> v0 = a, v1 = b, v2 = c;
  const Real<D> one = Splat(d, 1), equal = Splat(d, 1 + 0x1p-6);
  const Real<D> s01 = (one - d01) * equal, s12 = one - d12, s20 = one - d20;
  const Mask<D> arc01 = hn::And(hn::Ge(s01, s12), hn::Ge(s01, s20));
  const Mask<D> arc12 = hn::AndNot(arc01, hn::Ge(s12 * equal, s20));
  a = Select<D>(arc01, v1, Select<D>(arc12, v2, v0));
  b = Select<D>(arc01, v2, Select<D>(arc12, v0, v1));
  c = Select<D>(arc01, v0, Select<D>(arc12, v1, v2));
}

/// Solid angle: Van Oosterom & Strackee 1983, "The Solid Angle of a Plane Triangle".
template <class D>
HWY_INLINE SphericalTriangle<D> SeenFrom(D d, const Vec3<D>& p0, const Vec3<D>& p1,
                                         const Vec3<D>& p2, const Vec3<D>& ref) {
  SphericalTriangle<D> t;
  t.p0 = Sub<D>(p0, ref);
  t.p1 = Sub<D>(p1, ref);
  t.p2 = Sub<D>(p2, ref);
  t.area_normal = Cross<D>(Sub<D>(p1, p0), Sub<D>(p2, p0));

  const Real<D> one = Splat(d, 1), zero = hn::Zero(d);
  const Real<D> q0 = Dot(t.p0, t.p0), q1 = Dot(t.p1, t.p1), q2 = Dot(t.p2, t.p2);
  const Real<D> r0 = SafeDiv(d, one, hn::Sqrt(q0)), r1 = SafeDiv(d, one, hn::Sqrt(q1)),
                r2 = SafeDiv(d, one, hn::Sqrt(q2));
  t.a = Scale(t.p0, r0);
  t.b = Scale(t.p1, r1);
  t.c = Scale(t.p2, r2);
  // The height over the plane cancels least when measured from the nearest vertex.
  const Mask<D> near1 = hn::Lt(q1, q0);
  const Vec3<D> nearer = Select<D>(near1, t.p1, t.p0);
  const Vec3<D> nearest = Select<D>(hn::Lt(q2, hn::Min(q0, q1)), t.p2, nearer);
  t.triple = Dot(t.area_normal, nearest);
  t.volume = hn::Abs(t.triple * r0 * r1 * r2);
  const Real<D> height = hn::Abs(t.triple) * hn::Min(r0, hn::Min(r1, r2));  // times twice the area
  t.blur = SafeDiv(d, Splat(d, kPlaneError) * hn::Sqrt(Dot(t.area_normal, t.area_normal)), height);

  const Real<D> d01 = Dot(t.a, t.b), d12 = Dot(t.b, t.c), d20 = Dot(t.c, t.a);
  t.solid_angle = Splat(d, 2) * AngleOf(d, t.volume, one + d01 + d12 + d20);
  PutLongestArcFirst(d, d01, d12, d20, t.a, t.b, t.c);
  const Vec3<D> sum = Add(t.a, t.b);
  t.one_plus_ab = Splat(d, 0.5) * Dot(sum, sum);
  t.ac = Dot(t.a, t.c);
  t.bc = Dot(t.b, t.c);
  t.tiny = hn::Lt(t.solid_angle, Splat(d, kLeastSolidAngle));
  t.huge = hn::Gt(t.solid_angle, Splat(d, kGreatestSolidAngle));
  // A triangle seen edge on has no inside and no side.
  const double most = IsMutant(Mutant::blurred_lights) ? 1e30 : kGreatestBlur;
  const Mask<D> clear = hn::Le(t.blur, Splat(d, most));
  t.solid_angle = hn::IfThenElseZero(hn::And(clear, hn::Gt(t.volume, zero)), t.solid_angle);
  return t;
}

/// Uniform on the spherical triangle: c' on the arc from a to c cuts off u.x of the area, then the
/// height of a zone about b is uniform in u.y.
template <class D>
HWY_INLINE Vec3<D> SampleSphericalTriangle(D d, const SphericalTriangle<D>& t, const Vec2<D>& u) {
  const Angle<D> half = AngleFromRadians(d, Splat(d, 0.5) * u.x * t.solid_angle);
  // h halves the arc from a to c' (Peters 2021, section 3.2).
  const Vec3<D> h = MulAdd(t.a, hn::NegMulAdd(t.ac + t.bc, half.sin, t.volume * half.cos),
                           Scale(t.c, t.one_plus_ab * half.sin));
  const Real<D> reflect = SafeDiv(d, Splat(d, 2) * Dot(t.a, h), Dot(h, h));
  const Vec3<D> c = Sub<D>(Scale(h, reflect), t.a);

  // 1 - cos of the arc from b to c', from the chord: no cancellation where the arc is short.
  const Vec3<D> chord = Sub<D>(c, t.b);
  const Real<D> versine = Splat(d, 0.5) * Dot(chord, chord);
  const Real<D> w = u.y * versine, two = Splat(d, 2);
  // Towards c' at right angles to b, as long as the sine of that arc; shortened to the sine here.
  const Vec3<D> across = MulAdd(t.b, versine, chord);
  const Real<D> shorter = SafeSqrt(d, SafeDiv(d, u.y * (two - w), two - versine));
  return MulAdd(across, shorter, Scale(t.b, Splat(d, 1) - w));
}

/// Barycentrics of p1 and p2 where the ray from the receiver along `w` meets the plane.
template <class D>
struct Barycentrics {
  Real<D> b1, b2;
};
template <class D>
HWY_INLINE Barycentrics<D> MeetPlane(D d, const SphericalTriangle<D>& t, const Vec3<D>& w) {
  const Real<D> along = Dot(t.area_normal, w);
  const Real<D> inverse = hn::CopySign(SafeDiv(d, Splat(d, 1), hn::Abs(along)), along);
  const auto share = [&](const Vec3<D>& from, const Vec3<D>& to)
                         HWY_ATTR { return Dot(w, Cross<D>(from, to)) * inverse; };
  return {share(t.p2, t.p0), share(t.p0, t.p1)};
}

template <class D>
HWY_INLINE Barycentrics<D> SampleBySolidAngle(D d, const SphericalTriangle<D>& t,
                                              const Vec2<D>& u) {
  const Barycentrics<D> b = MeetPlane(d, t, SampleSphericalTriangle(d, t, u));
  const Real<D> zero = hn::Zero(d), one = Splat(d, 1);
  const Real<D> b1 = hn::Min(hn::Max(b.b1, zero), one);
  return {b1, hn::Min(hn::Max(b.b2, zero), one - b1)};
}

/// Uniform over the area: Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
template <class D>
HWY_INLINE Barycentrics<D> SampleByArea(D d, const Vec2<D>& u) {
  const Real<D> half = Splat(d, 0.5);
  const Mask<D> lower = hn::Gt(u.y, u.x);
  return {hn::IfThenElse(lower, u.x * half, hn::NegMulAdd(half, u.y, u.x)),
          hn::IfThenElse(lower, hn::NegMulAdd(half, u.x, u.y), u.y * half)};
}

/// Uniform over the hemisphere in which the triangle lies; may miss it (b1, b2 or their rest is <
/// 0).
template <class D>
HWY_INLINE Barycentrics<D> SampleByHemisphere(D d, const SphericalTriangle<D>& t,
                                              const Vec2<D>& u) {
  const Vec3<D> normal = SafeNormalize(d, t.area_normal, Splat3(d, 0, 0, 1));
  const Frame<D> frame =
      MakeFrame(d, Select<D>(hn::Lt(t.triple, hn::Zero(d)), Neg<D>(normal), normal));
  const Real<D> z = u.x, r = SafeSqrt(d, hn::NegMulAdd(z, z, Splat(d, 1)));
  const Angle<D> azimuth = AngleFromRadians(d, Splat(d, 2 * kPi) * (u.y - Splat(d, 0.5)));
  return MeetPlane(d, t, ToWorld(frame, Vec3<D>{r * azimuth.cos, r * azimuth.sin, z}));
}

/// Density per solid angle of choosing the point at `distance` along the unit `wi`.
template <class D>
HWY_INLINE Real<D> PdfOf(D d, const SphericalTriangle<D>& t, const Vec3<D>& wi, Real<D> distance) {
  const Real<D> even = hn::IfThenElse(t.huge, Splat(d, 2 * kPi), t.solid_angle);
  const Real<D> density =
      SafeDiv(d, hn::IfThenElse(t.tiny, Splat(d, 2) * distance * distance, Splat(d, 1)),
              hn::IfThenElse(t.tiny, hn::Abs(Dot(t.area_normal, wi)), even));
  return hn::IfThenElseZero(hn::Gt(t.solid_angle, hn::Zero(d)), density);
}

/// A point of the triangle as seen from `ref`. From within the triangle's plane, or too near to it,
/// there is none (pdf 0).
template <class D>
HWY_INLINE TriangleLightSample<D> SampleTriangleLight(D d, const Vec3<D>& p0, const Vec3<D>& p1,
                                                      const Vec3<D>& p2, const Vec3<D>& ref,
                                                      const Vec2<D>& u) {
  const SphericalTriangle<D> t = SeenFrom(d, p0, p1, p2, ref);
  const Mask<D> middling = hn::Not(hn::Or(t.tiny, t.huge));
  Barycentrics<D> b = SampleByArea(d, u);
  if (!hn::AllFalse(d, middling)) {
    const Barycentrics<D> other = SampleBySolidAngle(d, t, u);
    b = {hn::IfThenElse(middling, other.b1, b.b1), hn::IfThenElse(middling, other.b2, b.b2)};
  }
  if (!hn::AllFalse(d, t.huge)) {
    const Barycentrics<D> other = SampleByHemisphere(d, t, u);
    b = {hn::IfThenElse(t.huge, other.b1, b.b1), hn::IfThenElse(t.huge, other.b2, b.b2)};
  }
  const Real<D> zero = hn::Zero(d), b0 = Splat(d, 1) - b.b1 - b.b2;
  const Vec3<D> point = MulAdd(t.p0, b0, MulAdd(t.p1, b.b1, Scale(t.p2, b.b2)));
  const Real<D> distance = SafeSqrt(d, Dot(point, point));
  const Vec3<D> wi = Scale(point, SafeDiv(d, Splat(d, 1), distance));
  const Mask<D> missed = hn::Or(hn::Lt(b0, zero), hn::Lt(hn::Min(b.b1, b.b2), zero));
  const Mask<D> ok = hn::AndNot(hn::And(t.huge, missed), hn::Gt(distance, zero));
  return {b.b1, b.b2, wi, distance, t.blur, hn::IfThenElseZero(ok, PdfOf(d, t, wi, distance))};
}

/// Density with which `SampleTriangleLight` returns the point at `distance` along the unit `wi`.
template <class D>
HWY_INLINE Real<D> TriangleLightPdf(D d, const Vec3<D>& p0, const Vec3<D>& p1, const Vec3<D>& p2,
                                    const Vec3<D>& ref, const Vec3<D>& wi, Real<D> distance) {
  return PdfOf(d, SeenFrom(d, p0, p1, p2, ref), wi, distance);
}

}  // namespace lights

using lights::SampleTriangleLight;
using lights::TriangleLightPdf;
using lights::TriangleLightSample;

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
