// Camera rays: filter importance sampling, perspective and orthographic projection, the initial ray
// cone.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_CAMERA_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_CAMERA_INL_H_
#undef CARPOOL_STAGES_KERNELS_CAMERA_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_CAMERA_INL_H_
#endif

#include "stages/kernels/kernels.h"
#include "stages/sampling/filter-inl.h"
#include "stages/sampling/sobol-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// Point of the image plane, in units of the camera's half extents, right and up.
template <class D>
HWY_INLINE Vec2<D> ImagePlanePoint(D d, const KernelContext& c, Uint<D> pixel,
                                   const Vec2<D>& offset) {
  const IntTag<D> di;
  // Exact for widths up to 65,536: pixel numbers are below 2^28 and the quotient is mended by one
  // step.
  const Int<D> index = hn::BitCast(di, pixel);
  const Int<D> width = hn::Set(di, static_cast<int32_t>(c.width));
  const Real<D> guess = hn::ConvertTo(d, index) * Splat(d, 1.0 / c.width);
  Int<D> row = hn::ConvertTo(di, guess);
  row = hn::IfThenElse(hn::Gt(row * width, index), row - hn::Set(di, 1), row);
  row = hn::IfThenElse(hn::Gt(index - row * width, width - hn::Set(di, 1)), row + hn::Set(di, 1),
                       row);
  const Int<D> column = index - row * width;
  const Real<D> half = Splat(d, 0.5);
  const Real<D> x = hn::ConvertTo(d, column) + half + offset.x;
  const Real<D> y = hn::ConvertTo(d, row) + half + offset.y;
  return {hn::MulSub(x, Splat(d, 2.0 / c.width), Splat(d, 1)),
          hn::NegMulAdd(y, Splat(d, 2.0 / c.height), Splat(d, 1))};
}

/// One ray per lane. Rays of one camera have the same cone.
template <class D>
struct CameraRay {
  Vec3<D> origin, direction;
};
template <class D>
HWY_INLINE CameraRay<D> MakeCameraRay(D d, const KernelContext& c, Uint<D> pixel, Uint<D> sample) {
  const SampleKey<D> key = MakeSampleKey(d, pixel, sample, c.seed);
  const Vec2<D> u = Sample2D(d, key, hn::Zero(UintTag<D>()), Purpose::camera_filter);
  const Vec2<D> plane = ImagePlanePoint(d, c, pixel, SamplePixelFilter(d, u));

  const float* m = c.camera.world_from_camera;
  const auto axis = [&](int column)
                        HWY_ATTR { return Splat3(d, m[column], m[4 + column], m[8 + column]); };
  const Real<D> x = plane.x * Splat(d, c.camera.half_width);
  const Real<D> y = plane.y * Splat(d, c.camera.half_height);
  const Vec3<D> sideways = MulAdd(axis(0), x, Scale(axis(1), y));
  if (c.camera.orthographic != 0) return {Add<D>(axis(3), sideways), Neg<D>(axis(2))};
  return {axis(3), Normalize(d, Sub<D>(sideways, axis(2)))};
}

/// Width at the origin (metres) and growth per metre of the cone that is one pixel.
struct CameraCone {
  double width, spread;
};
inline CameraCone ConeOf(const KernelContext& c) {
  const double extent = 2.0 * c.camera.half_height / c.height;
  return c.camera.orthographic != 0 ? CameraCone{extent, 0} : CameraCone{0, extent};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
