// Picks one light of many by descending the light tree, and tells with what probability it would.
//
// Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting": at
// each node the two children compete by a bound of what they may contribute to the receiver, and
// one number in [0, 1) decides, remapped on the way.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_LIGHT_TREE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_LIGHT_TREE_INL_H_
#undef CARPOOL_STAGES_KERNELS_LIGHT_TREE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_LIGHT_TREE_INL_H_
#endif

#include <cstddef>

#include "stages/kernels/light_math-inl.h"
#include "stages/simd/quads-inl.h"
#include "stages/tables/light_view.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace lights {

/// A light of the tree, and the probability of having picked it from the tree.
template <class D>
struct LightPick {
  Int<D> light;         // kNone: no light of the tree can reach the receiver
  Real<D> probability;  // 0 with kNone
  Real<D> u_remapped;   // in [0, 1), uniform again given the light
};

/// Where light is to arrive. A zero normal means a receiver that takes light from all sides alike.
template <class D>
struct Receiver {
  Vec3<D> position, normal;
  Mask<D> all_sides;
};
template <class D>
HWY_INLINE Receiver<D> MakeReceiver(D d, const Vec3<D>& position, const Vec3<D>& normal) {
  return {position, normal, hn::Not(hn::Gt(Dot(normal, normal), hn::Zero(d)))};
}

// Bounds come from rounded numbers, axes from 16 bits (the angle from them, near 0 or pi, is off by
// up to 0.008). So nothing is culled by less than this difference of cosines, and what is not
// culled keeps at least this share of its unoccluded, perpendicular importance.
constexpr double kCullMargin = 1e-2;
constexpr double kLeastEmission = 1e-3;
// Receivers below the horizon of a shading normal may still take light (transmission, bump maps).
constexpr double kLeastReception = 0.02;
// Powers are shares of 1, so that with this least squared distance no importance overflows.
constexpr double kLeastSquaredDistance = 1e-30;
constexpr double kLeastImportance = 1e-37;
constexpr double kLeastShare = 1.0 / 1024;  // of a child among the two, if it may contribute at all

/// One node per lane.
template <class D>
struct NodeLanes {
  Vec3<D> center, axis;
  Real<D> radius, signed_power;
  Angle<D> o;
  Real<D> cos_e;
  Int<D> child_or_light;
};
template <class D>
HWY_INLINE NodeLanes<D> LoadNode(D d, const LightNode* nodes, Int<D> node) {
  const IntTag<D> di;
  const Quad<D> sphere = FieldQuad(d, nodes, node, offsetof(LightNode, center));
  const Int<D> shape =
      QuadInt(d, nodes, node, offsetof(LightNode, cos_theta_e), sphere.w);  // and radius
  const IntQuad<D> rest = FieldIntQuad(d, nodes, node, offsetof(LightNode, axis));
  const Int<D> upper_half = hn::Set(di, static_cast<int32_t>(0xffff0000));
  const Real<D> unit = Splat(d, 1 / kFixedOne);
  NodeLanes<D> lanes;
  lanes.center = {sphere.x, sphere.y, sphere.z};
  lanes.radius = RealOfBits(d, hn::And(shape, upper_half));
  lanes.cos_e = LowerHalf(d, shape) * unit;
  lanes.axis = {LowerHalf(d, rest.x) * unit, UpperHalf(d, rest.x) * unit,
                LowerHalf(d, rest.y) * unit};
  lanes.o = {UpperHalf(d, rest.y) * unit, LowerHalf(d, rest.z) * unit};
  lanes.signed_power = RealOfBits(d, hn::And(rest.z, upper_half));
  lanes.child_or_light = rest.w;
  return lanes;
}
static_assert(offsetof(LightNode, radius) == offsetof(LightNode, cos_theta_e) + 2 &&
              offsetof(LightNode, cos_theta_o) == offsetof(LightNode, axis) + 6 &&
              offsetof(LightNode, sin_theta_o) == offsetof(LightNode, axis) + 8 &&
              offsetof(LightNode, signed_power) == offsetof(LightNode, axis) + 10 &&
              offsetof(LightNode, child_or_light) == offsetof(LightNode, axis) + 12);

/// The same node in all lanes.
template <class D>
HWY_INLINE NodeLanes<D> SameNode(D d, const LightNode& node) {
  const auto fixed = [&](int16_t value) HWY_ATTR { return Splat(d, FromFixed(value)); };
  return {Splat3(d, node.center[0], node.center[1], node.center[2]),
          {fixed(node.axis[0]), fixed(node.axis[1]), fixed(node.axis[2])},
          Splat(d, FromUpperHalf(node.radius)),
          Splat(d, FromUpperHalf(node.signed_power)),
          {fixed(node.cos_theta_o), fixed(node.sin_theta_o)},
          fixed(node.cos_theta_e),
          hn::Set(IntTag<D>(), node.child_or_light)};
}

/// Cosine bound of the emitters' normals: 0 where nothing of the cluster can shine towards the
/// receiver. `cos_w` is between the axis and the direction from the cluster's centre to the
/// receiver.
template <class D>
HWY_INLINE Real<D> EmissionBound(D d, const NodeLanes<D>& node, Real<D> cos_w,
                                 const Angle<D>& subtended) {
  const Mask<D> two_sided = hn::Lt(node.signed_power, hn::Zero(d));
  const Angle<D> w = AngleFromCos(d, hn::IfThenElse(two_sided, hn::Abs(cos_w), cos_w));
  const Real<D> cos = SubtractClamped(d, SubtractClamped(d, w, node.o), subtended).cos;
  return hn::IfThenElseZero(hn::Gt(cos, node.cos_e - Splat(d, kCullMargin)),
                            hn::Max(cos, Splat(d, kLeastEmission)));
}

/// Bound of the receiver's cosine over the cluster; `cos_i` is towards the cluster's centre.
template <class D>
HWY_INLINE Real<D> ReceptionBound(D d, const Receiver<D>& receiver, Real<D> cos_i,
                                  const Angle<D>& subtended) {
  const Real<D> cos = SubtractClamped(d, AngleFromCos(d, cos_i), subtended).cos;
  return hn::IfThenElse(receiver.all_sides, Splat(d, 1), hn::Max(cos, Splat(d, kLeastReception)));
}

/// What the cluster may contribute to the receiver, up to a factor common to all nodes.
template <class D>
HWY_INLINE Real<D> Importance(D d, const NodeLanes<D>& node, const Receiver<D>& receiver) {
  const Real<D> one = Splat(d, 1);
  const Vec3<D> away = Sub<D>(receiver.position, node.center);
  const Real<D> squared = Dot(away, away), squared_radius = node.radius * node.radius;
  const Real<D> floor = hn::Max(squared_radius, Splat(d, kLeastSquaredDistance));
  const Mask<D> outside = hn::Gt(squared, floor);
  const Real<D> inverse_square = one / hn::Max(squared, floor);
  const Real<D> inverse = hn::Sqrt(inverse_square);
  // Inside the sphere the cluster may lie in any direction: an angle of pi takes every bound to 1.
  const Real<D> sin_b = hn::IfThenElseZero(outside, node.radius * inverse);
  const Real<D> cos_b =
      hn::IfThenElse(outside, SafeSqrt(d, hn::NegMulAdd(sin_b, sin_b, one)), Splat(d, -1));
  const Angle<D> subtended = {cos_b, sin_b};

  const Real<D> cos_w = hn::IfThenElse(outside, Dot(node.axis, away) * inverse, one);
  const Real<D> cos_i = hn::IfThenElse(outside, hn::Neg(Dot(receiver.normal, away)) * inverse, one);
  const Real<D> emission = EmissionBound(d, node, cos_w, subtended);
  const Real<D> reception = ReceptionBound(d, receiver, cos_i, subtended);
  const Real<D> importance = hn::Abs(node.signed_power) * (emission * reception) * inverse_square;
  return hn::IfThenElseZero(hn::Gt(emission, hn::Zero(d)),
                            hn::Max(importance, Splat(d, kLeastImportance)));
}

/// Probability of the left child of a pair with these importances, of which one is > 0. Bounds can
/// be wrong by any factor (a bright light behind a wall), so neither child that may contribute is
/// starved.
template <class D>
HWY_INLINE Real<D> LeftProbability(D d, Real<D> left, Real<D> right) {
  const Real<D> zero = hn::Zero(d), one = Splat(d, 1), least = Splat(d, kLeastShare);
  const Real<D> shared = hn::Min(hn::Max(SafeDiv(d, left, left + right), least), one - least);
  return hn::IfThenElseZero(hn::Gt(left, zero), hn::IfThenElse(hn::Gt(right, zero), shared, one));
}

/// A stream of numbers in [0, 1) that refills the bits which remapping uses up: a descent through
/// many rare branches would otherwise decide on zeros. Mixing function: C. Wellons' "lowbias32".
template <class D>
struct Refill {
  Uint<D> state;

  static HWY_INLINE Refill Make(D, const Vec3<D>& position, Real<D> u) {
    const UintTag<D> du;
    Uint<D> state = hn::BitCast(du, u);
    for (const Real<D>& seed : {position.x, position.y, position.z}) {
      state = Mix(state + hn::BitCast(du, seed) + hn::Set(du, 0x9e3779b9u));
    }
    return {state};
  }
  HWY_INLINE Real<D> Next(D d) {
    const UintTag<D> du;
    state = Mix(state + hn::Set(du, 0x9e3779b9u));
    const auto bits = hn::BitCast(IntTag<D>(), hn::ShiftRight<8>(state));
    return hn::ConvertTo(d, bits) * Splat(d, 1.0 / (1 << 24));
  }

 private:
  static HWY_INLINE Uint<D> Mix(Uint<D> x) {
    const UintTag<D> du;
    x = (x ^ hn::ShiftRight<16>(x)) * hn::Set(du, 0x7feb352du);
    x = (x ^ hn::ShiftRight<15>(x)) * hn::Set(du, 0x846ca68bu);
    return x ^ hn::ShiftRight<16>(x);
  }
};

/// Any of `view.uniform_count` lights; those that are not in the tree give no sample.
template <class D>
HWY_INLINE LightPick<D> PickUniform(D d, const LightView& view, Mask<D> active, Real<D> u) {
  const IntTag<D> di;
  const Real<D> place = u * Splat(d, view.uniform_count);
  const Real<D> whole =
      hn::Min(hn::Floor(place), Splat(d, static_cast<double>(view.uniform_count) - 1));
  const Int<D> light = hn::ConvertTo(di, whole);
  const Int<D> leaf = FieldInt(d, view.lights, light, offsetof(Light, leaf));
  const Mask<D> in_tree = hn::And(active, ToMask(d, hn::Gt(leaf, hn::Set(di, kNone))));
  return {hn::IfThenElse(ToIntMask(d, in_tree), light, hn::Set(di, kNone)),
          hn::IfThenElseZero(in_tree, Splat(d, 1.0 / view.uniform_count)),
          hn::Min(place - whole, Splat(d, kLargestBelowOne))};
}

/// Lanes on their way from the root to a light, with one number per lane. Several can be on their
/// way in turns, so that one's nodes come from memory while another one decides.
template <class D>
struct Descent {
  Receiver<D> receiver;
  Refill<D> refill;
  LightPick<D> pick;  // of lanes that are no longer active: the result
  Int<D> child;       // of active lanes: the left one of the pair that is compared next
  Mask<D> active;
};

/// Asks for the pairs that the lanes will compare next.
template <class D>
HWY_INLINE void PrefetchPairs(D, const LightNode* nodes, Int<D> pairs) {
  HWY_ALIGN int32_t at[hn::MaxLanes(D())];
  hn::Store(pairs, IntTag<D>(), at);
  for (const int32_t pair : at) __builtin_prefetch(&nodes[pair]);
}

/// To the pair's left or right node, in the lanes that are active; to its light, if it is a leaf.
template <class D>
HWY_INLINE void Choose(D d, const LightView& view, const NodeLanes<D>& left,
                       const NodeLanes<D>& right, Descent<D>& to) {
  const IntTag<D> di;
  const Int<D> zero = hn::Zero(di);
  const Real<D> left_importance = Importance(d, left, to.receiver);
  const Real<D> right_importance = Importance(d, right, to.receiver);
  const Real<D> sum = left_importance + right_importance;
  const Mask<D> dark = hn::And(to.active, hn::Not(hn::Gt(sum, hn::Zero(d))));
  to.pick.probability = hn::IfThenZeroElse(dark, to.pick.probability);
  to.active = hn::AndNot(dark, to.active);

  const Real<D> p = LeftProbability(d, left_importance, right_importance);
  const Real<D> u = to.pick.u_remapped;
  const Mask<D> go_left = hn::Lt(u, p);
  to.child = hn::IfThenElse(ToIntMask(d, go_left), left.child_or_light, right.child_or_light);
  PrefetchPairs(d, view.nodes, hn::Max(to.child, zero));
  const Real<D> q = hn::IfThenElse(go_left, p, Splat(d, 1) - p);
  const Real<D> rest = hn::IfThenElse(go_left, u, u - p);
  const Real<D> refilled = hn::MulAdd(to.refill.Next(d), Splat(d, 1.0 / (1 << 24)), rest);
  const Real<D> remapped = hn::Min(SafeDiv(d, refilled, q), Splat(d, kLargestBelowOne));
  to.pick.u_remapped = hn::IfThenElse(to.active, remapped, u);
  to.pick.probability = hn::IfThenElse(to.active, to.pick.probability * q, to.pick.probability);

  const Mask<D> leaf = hn::And(to.active, ToMask(d, hn::Lt(to.child, zero)));
  to.pick.light = hn::IfThenElse(ToIntMask(d, leaf), hn::Not(to.child), to.pick.light);
  to.active = hn::AndNot(leaf, to.active);
}

/// One level down, in the lanes that are active.
template <class D>
HWY_INLINE void Descend(D d, const LightView& view, Descent<D>& to) {
  const IntTag<D> di;
  const Int<D> pair = hn::IfThenElseZero(ToIntMask(d, to.active), to.child);
  Choose(d, view, LoadNode(d, view.nodes, pair), LoadNode(d, view.nodes, pair + hn::Set(di, 1)),
         to);
}

/// At the pair below the root, if it is not the root that is the only light.
template <class D>
HWY_INLINE Descent<D> StartDescent(D d, const LightView& view, Mask<D> active,
                                   const Vec3<D>& position, const Vec3<D>& normal, Real<D> u) {
  const IntTag<D> di;
  const Mask<D> none = hn::Lt(u, u);
  Descent<D> descent = {MakeReceiver(d, position, normal),
                        Refill<D>::Make(d, position, u),
                        {hn::Set(di, kNone), hn::IfThenElseZero(active, Splat(d, 1)), u},
                        hn::Zero(di),
                        active};
  if (view.uniform_count > 0) {
    descent.pick = PickUniform(d, view, active, u);
    descent.active = none;
  } else if (view.node_count == 0) {
    descent.pick.probability = hn::Zero(d);
    descent.active = none;
  } else if (const int32_t child = view.nodes[0].child_or_light; child < 0) {
    descent.pick.light =
        hn::IfThenElse(ToIntMask(d, active), hn::Set(di, ~child), descent.pick.light);
    descent.active = none;
  } else if (!hn::AllFalse(d, active)) {
    Choose(d, view, SameNode(d, view.nodes[child]), SameNode(d, view.nodes[child + 1]), descent);
  }
  return descent;
}

/// A light for every active lane.
template <class D>
HWY_INLINE LightPick<D> PickLight(D d, const LightView& view, Mask<D> active,
                                  const Vec3<D>& position, const Vec3<D>& normal, Real<D> u) {
  Descent<D> descent = StartDescent(d, view, active, position, normal, u);
  while (!hn::AllFalse(d, descent.active)) Descend(d, view, descent);
  return descent.pick;
}

/// Probability with which `PickLight` returns `light` (kNone allowed: 0), climbing from its leaf.
template <class D>
HWY_INLINE Real<D> PickProbability(D d, const LightView& view, Mask<D> active,
                                   const Vec3<D>& position, const Vec3<D>& normal, Int<D> light) {
  const IntTag<D> di;
  const Int<D> zero = hn::Zero(di), one = hn::Set(di, 1);
  if (view.node_count == 0) return hn::Zero(d);
  const Receiver<D> receiver = MakeReceiver(d, position, normal);
  const auto lit = hn::And(ToIntMask(d, active), hn::Gt(light, hn::Set(di, kNone)));
  Int<D> node = hn::IfThenElse(
      lit, FieldInt(d, view.lights, hn::IfThenElseZero(lit, light), offsetof(Light, leaf)),
      hn::Set(di, kNone));
  active = ToMask(d, hn::Gt(node, hn::Set(di, kNone)));
  if (view.uniform_count > 0) return hn::IfThenElseZero(active, Splat(d, 1.0 / view.uniform_count));
  Real<D> probability = hn::IfThenElseZero(active, Splat(d, 1));

  while (!hn::AllFalse(d, active)) {
    const Int<D> here = hn::Max(node, zero);
    const Int<D> pair = hn::AndNot(one, here);
    const NodeLanes<D> left = LoadNode(d, view.nodes, pair);
    const NodeLanes<D> right = LoadNode(d, view.nodes, pair + one);
    const Real<D> left_importance = Importance(d, left, receiver);
    const Real<D> right_importance = Importance(d, right, receiver);
    const auto is_left = hn::Eq(here, pair);
    const Int<D> parent = GatherInt(d, view.parents, hn::ShiftRight<1>(pair));
    active = hn::And(active, ToMask(d, hn::Gt(parent, hn::Set(di, kNone))));
    const Mask<D> dark = hn::Not(hn::Gt(left_importance + right_importance, hn::Zero(d)));
    const Real<D> p = LeftProbability(d, left_importance, right_importance);
    const Real<D> q =
        hn::IfThenZeroElse(dark, hn::IfThenElse(ToMask(d, is_left), p, Splat(d, 1) - p));
    probability = hn::IfThenElse(active, probability * q, probability);
    node = hn::IfThenElse(ToIntMask(d, active), parent, node);
    active = hn::And(active, hn::Gt(probability, hn::Zero(d)));
  }
  return probability;
}

}  // namespace lights

using lights::LightPick;
using lights::PickLight;
using lights::PickProbability;

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
