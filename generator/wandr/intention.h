// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "generator/wandr/rotation_6d.h"

namespace holdfast::wandr {

/// Heading frame of a body with root rotation R = Rz(a) Ry(b) Rx(g): Z = Rz(a), where a is the
/// azimuth of the lateral axis R e_x. The body faces -y of this frame: h = -Z e_y. Undefined only
/// if the lateral axis is vertical (lying on one side).
template <typename T>
struct Heading {
  T cosine = T(1);
  T sine = T(0);
  /// a(R Exp(phi)) = a(R) + gradient . phi: (0, R21, R22) / (R00^2 + R10^2).
  Vector3<T> gradient = Vector3<T>::Zero();

  /// Z v: from the heading frame to the world.
  Vector3<T> ToWorld(const Vector3<T>& v) const {
    return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y(), v.z()};
  }
  /// Z^T v: from the world to the heading frame.
  Vector3<T> FromWorld(const Vector3<T>& v) const {
    return {cosine * v.x() + sine * v.y(), cosine * v.y() - sine * v.x(), v.z()};
  }
  /// h = -Z e_y, the facing direction of the body, a horizontal unit vector.
  Vector3<T> Forward() const { return {sine, -cosine, T(0)}; }
};

template <typename T>
Heading<T> HeadingOf(const Matrix3<T>& root) {
  const T squared = std::max(root(0, 0) * root(0, 0) + root(1, 0) * root(1, 0), T(1e-12));
  const T inverse = T(1) / std::sqrt(squared);
  Heading<T> heading;
  heading.cosine = root(0, 0) * inverse;
  heading.sine = root(1, 0) * inverse;
  heading.gradient = Vector3<T>(T(0), root(2, 1), root(2, 2)) / squared;
  return heading;
}

/// R_xy = Z^T R = Ry(b) Rx(g), the root rotation without heading. Entry (1, 0) is set to exactly 0,
/// because its standard deviation is 0 and normalization would amplify rounding errors.
template <typename T>
Matrix3<T> WithoutHeading(const Heading<T>& heading, const Matrix3<T>& root) {
  Matrix3<T> R_xy;
  R_xy.row(0) = heading.cosine * root.row(0) + heading.sine * root.row(1);
  R_xy.row(1) = heading.cosine * root.row(1) - heading.sine * root.row(0);
  R_xy.row(2) = root.row(2);
  R_xy(1, 0) = T(0);
  return R_xy;
}

/// phi_bar of the root from six_bar of rows12(R_xy). The perturbation of R_xy is
/// (I - r3 gradient^T) phi, r3 = R^T e_z. The gradient of the entry that is always 0 is ignored.
template <typename T>
Vector3<T> WithoutHeadingVjp(const Heading<T>& heading, const Matrix3<T>& R_xy,
                             const Vector6<T>& six_bar) {
  Vector6<T> bar = six_bar;
  bar[3] = T(0);
  const Vector3<T> psi_bar = Rows12Vjp<T>(R_xy, bar);
  return psi_bar - heading.gradient * R_xy.row(2).dot(psi_bar.transpose());
}

/// a_bar from y_bar, where y = Z^T v for a constant v: dy = -(e_z x y) da.
template <typename T>
T TurnVjp(const Vector3<T>& y, const Vector3<T>& y_bar) {
  return y.y() * y_bar.x() - y.x() * y_bar.y();
}

/// Encoding of the goal at the end of the condition.
enum class IntentionLayout {
  kPaper,    ///< 9 values: I^w, I^p, I^r; all zero without a goal
  kFlagged,  ///< 10 values: as kPaper, then 1 with a goal, 0 without (motion prior)
  /// 13 values, bounded for any deadline: I^w limited by tanh to 2 m/s (3), the wrist-to-goal
  /// offset saturated as I^p (3), I^p (x, y), I^r (x, y), exp(-eta/30), exp(-eta/8), flag
  kBounded,
};

inline constexpr int IntentionSize(IntentionLayout layout) {
  return layout == IntentionLayout::kPaper ? 9 : layout == IntentionLayout::kFlagged ? 10 : 13;
}

inline constexpr double kFramesPerSecond = 30.0;
inline constexpr double kMaxIntention = 2.0;  ///< D_max, meters (`max_distance`); m/s in tanh

/// Which of I^w, I^p, I^r are given to the network; the others are zero. For ablations.
struct IntentionParts {
  bool wrist = true;
  bool pelvis = true;
  bool heading = true;
};

/// Target of the wrist at one frame.
template <typename T>
struct FrameGoal {
  bool active = false;
  Vector3<T> position = Vector3<T>::Zero();  ///< G, world, meters
  T frames_left = T(0);                      ///< eta
  IntentionParts parts = {};
};

/// Body quantities that the intention depends on.
template <typename T>
struct IntentionBody {
  Heading<T> heading;
  Vector3<T> pelvis;  ///< P, joint 0
  Vector3<T> wrist;   ///< W, joint 21 (or 20)
};

/// Gradients with respect to the inputs of the intention.
template <typename T>
struct IntentionBar {
  Vector3<T> pelvis = Vector3<T>::Zero();
  Vector3<T> wrist = Vector3<T>::Zero();
  Vector3<T> goal = Vector3<T>::Zero();
  T turn = T(0);  ///< of the heading azimuth a
};

/// Radial map v = r(n) e / n of e with norm n, in the form needed by its (symmetric) Jacobian
/// (r/n) (I - ee^T/n^2) + r' ee^T/n^2.
template <typename T>
struct RadialMap {
  Vector3<T> direction;
  T ratio;  ///< r(n) / n
  T slope;  ///< r'(n)

  /// r = D (1 - exp(-n)).
  static RadialMap Saturating(const Vector3<T>& e) {
    const T limit = T(kMaxIntention), n = e.norm(), decay = std::exp(-n);
    if (n < T(1e-6)) return {Vector3<T>::Zero(), limit, limit};
    return {e / n, -limit * std::expm1(-n) / n, limit * decay};
  }
  /// r = D tanh(n / D).
  static RadialMap Limiting(const Vector3<T>& e) {
    const T limit = T(kMaxIntention), n = e.norm(), r = std::tanh(n / limit);
    if (n < T(1e-6)) return {Vector3<T>::Zero(), T(1), T(1)};
    return {e / n, limit * r / n, T(1) - r * r};
  }
  Vector3<T> Vjp(const Vector3<T>& v_bar) const {
    return ratio * v_bar + (slope - ratio) * direction.dot(v_bar) * direction;
  }
};

/// g_hat towards the goal: the horizontal unit vector of e = G - P, and 1/|e_xy|. Zero directly
/// above or below the pelvis, where the heading is undefined (no turn is requested).
template <typename T>
struct GoalHeading {
  Vector3<T> direction = Vector3<T>::Zero();
  T inverse_distance = T(0);

  explicit GoalHeading(const Vector3<T>& e) {
    const T distance = std::sqrt(e.x() * e.x() + e.y() * e.y());
    if (distance < T(1e-6)) return;
    inverse_distance = T(1) / distance;
    direction = Vector3<T>(e.x(), e.y(), T(0)) * inverse_distance;
  }
};

/// Time left to the goal, s: tau = eta/30 + 1e-5.
template <typename T>
T TimeLeft(const FrameGoal<T>& goal) {
  return goal.frames_left / T(kFramesPerSecond) + T(1e-5);
}

/// Writes I (IntentionSize(layout) values), all in the heading frame:
///   I^w = Z^T (G - W) / tau, m/s
///   I^p = S Z^T v,  v = D_max (1 - exp(-n)) e/n, e = G - P, n = |e| (in 3D), S = diag(1, 1, 0)
///   I^r = S Z^T (g_hat - h) = S (Z^T g_hat + e_y)
template <typename T>
void WriteIntention(IntentionLayout layout, const IntentionBody<T>& body, const FrameGoal<T>& goal,
                    T* out) {
  std::fill_n(out, IntentionSize(layout), T(0));
  if (!goal.active) return;
  const Heading<T>& Z = body.heading;
  const Vector3<T> reach = goal.position - body.wrist, way = goal.position - body.pelvis;
  Vector3<T> velocity = Vector3<T>::Zero(), walk = velocity, turn = velocity;
  if (goal.parts.wrist) velocity = Z.FromWorld(reach / TimeLeft(goal));
  if (goal.parts.pelvis) walk = Z.FromWorld(RadialMap<T>::Saturating(way).ratio * way);
  const Vector3<T> wanted = GoalHeading<T>(way).direction;
  if (goal.parts.heading && wanted.squaredNorm() > T(0)) {
    turn = Z.FromWorld(wanted) + Vector3<T>::UnitY();
  }
  if (layout == IntentionLayout::kBounded) {
    Eigen::Map<Vector3<T>>{out} = RadialMap<T>::Limiting(velocity).ratio * velocity;
    if (goal.parts.wrist) {
      Eigen::Map<Vector3<T>>{out + 3} = Z.FromWorld(RadialMap<T>::Saturating(reach).ratio * reach);
    }
    out[6] = walk.x();
    out[7] = walk.y();
    out[8] = turn.x();
    out[9] = turn.y();
    out[10] = std::exp(-goal.frames_left / T(30));
    out[11] = std::exp(-goal.frames_left / T(8));
    out[12] = T(1);
    return;
  }
  Eigen::Map<Vector3<T>>{out} = velocity;
  out[3] = walk.x();
  out[4] = walk.y();
  out[6] = turn.x();
  out[7] = turn.y();
  if (layout == IntentionLayout::kFlagged) out[9] = T(1);
}

/// Adds to `bar` the gradients of body and goal for `intention_bar`. The deadline is constant.
template <typename T>
void WriteIntentionVjp(IntentionLayout layout, const IntentionBody<T>& body,
                       const FrameGoal<T>& goal, const T* intention_bar, IntentionBar<T>& bar) {
  if (!goal.active) return;
  const bool bounded = layout == IntentionLayout::kBounded;
  const Heading<T>& Z = body.heading;
  const Vector3<T> reach = goal.position - body.wrist, way = goal.position - body.pelvis;

  const auto told = [](bool part) { return part ? T(1) : T(0); };
  Vector3<T> velocity_bar = told(goal.parts.wrist) * Eigen::Map<const Vector3<T>>(intention_bar);
  const T tau = TimeLeft(goal);
  const Vector3<T> velocity = Z.FromWorld(reach / tau);
  if (bounded) velocity_bar = RadialMap<T>::Limiting(velocity).Vjp(velocity_bar);
  Vector3<T> reach_bar = Z.ToWorld(velocity_bar) / tau;
  bar.turn += TurnVjp<T>(velocity, velocity_bar);
  if (bounded) {
    const Vector3<T> offset_bar =
        told(goal.parts.wrist) * Eigen::Map<const Vector3<T>>(intention_bar + 3);
    const RadialMap<T> saturated = RadialMap<T>::Saturating(reach);
    reach_bar += saturated.Vjp(Z.ToWorld(offset_bar));
    bar.turn += TurnVjp<T>(Z.FromWorld(saturated.ratio * reach), offset_bar);
  }

  const T* const flat = intention_bar + (bounded ? 6 : 3);
  const Vector3<T> walk_bar = told(goal.parts.pelvis) * Vector3<T>(flat[0], flat[1], T(0));
  const RadialMap<T> saturated = RadialMap<T>::Saturating(way);
  Vector3<T> way_bar = saturated.Vjp(Z.ToWorld(walk_bar));
  bar.turn += TurnVjp<T>(Z.FromWorld(saturated.ratio * way), walk_bar);

  const T* const heading_bar = intention_bar + (bounded ? 8 : 6);
  const Vector3<T> turn_bar =
      told(goal.parts.heading) * Vector3<T>(heading_bar[0], heading_bar[1], T(0));
  const GoalHeading<T> towards(way);
  const Vector3<T> world_bar = Z.ToWorld(turn_bar);
  way_bar +=
      towards.inverse_distance * (world_bar - towards.direction.dot(world_bar) * towards.direction);
  bar.turn += TurnVjp<T>(Z.FromWorld(towards.direction), turn_bar);
  bar.wrist -= reach_bar;
  bar.pelvis -= way_bar;
  bar.goal += reach_bar + way_bar;
}

}  // namespace holdfast::wandr
