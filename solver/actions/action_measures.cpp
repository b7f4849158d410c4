// SPDX-License-Identifier: MIT
#include "solver/actions/action_measures.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "generator/matching/capture_quality.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/contact_score.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr int kEvery = 3;  // frames between whole-body measurements

// Vertices of holding hands in the object, per frame: one direction only, which is fast. From the
// grid: within 0.1 mm of the exact distances, in a hundredth of the time.
void MeasureHoldingHands(const ActionActor& actor, const ActionProp& prop, const Clip& clip,
                         ActionQuality& quality) {
  int penetrating = 0, touching = 0, held = 0;
  std::vector<HandState> states = {HandState(actor.Hand(Side::kRight)),
                                   HandState(actor.Hand(Side::kLeft))};
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const auto at = static_cast<std::size_t>(t);
    const Isometry3d object_from_world = clip.object->Pose(t).inverse();
    bool deep = false, touches = false;
    held += clip.holding_hand[at] != 0 ? 1 : 0;
    for (HandState& state : states) {
      const Side side = state.Hand().HandSide();
      if ((clip.holding_hand[at] & HoldingBit(side)) == 0) continue;
      state.SetBody(clip.pose[at], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[at], side), false);
      Eigen::VectorXd distances(state.Vertices().cols());
      for (Eigen::Index i = 0; i < distances.size(); ++i) {
        distances(i) = prop.fit.distance->Distance(object_from_world * state.Vertices().col(i));
      }
      const ContactMetrics contact = ContactFromDistances(distances);
      quality.deepest_mm = std::max(quality.deepest_mm, contact.max_penetration_mm);
      deep |= contact.max_penetration_mm > kDeep_mm;
      touches |= contact.in_contact;
    }
    penetrating += deep ? 1 : 0;
    touching += touches ? 1 : 0;
  }
  quality.penetrating = static_cast<double>(penetrating) / clip.NumFrames();
  quality.contact = static_cast<double>(touching) / std::max(1, held);
}

// The object in the rest of the body, and hands and forearms in head and trunk.
void MeasureInBody(const ActionActor& actor, const ActionProp& prop, const Clip& clip,
                   ActionQuality& quality) {
  const auto deepest = [](double& most_mm, const DistanceGrid& solid,
                          const Isometry3d& solid_from_points, const Eigen::Matrix3Xd& points) {
    most_mm = std::max(most_mm, 1000.0 * DeepestIn(solid, solid_from_points, points));
  };
  BodyState skin, forearms;
  std::vector<HandState> hands = {HandState(actor.Hand(Side::kRight)),
                                  HandState(actor.Hand(Side::kLeft))};
  for (int t = 0; t < clip.NumFrames(); t += kEvery) {
    const JointPose& pose = clip.pose[t];
    Forward(actor.Skin(), pose, clip.trans.col(t), skin);
    deepest(quality.object_in_body_mm, *prop.fit.distance, clip.object->Pose(t).inverse(),
            skin.vertices);
    const Isometry3d head = skin.WorldFromJoint(kHead).inverse();
    const Isometry3d chest = skin.WorldFromJoint(kSpine3).inverse();
    Forward(actor.Forearms(), pose, clip.trans.col(t), forearms);
    deepest(quality.arm_in_trunk_mm, actor.Trunk(), chest, forearms.vertices);
    for (HandState& hand : hands) {
      hand.SetBody(pose, clip.trans.col(t));
      hand.Evaluate(FingersOf(pose, hand.Hand().HandSide()), false);
      deepest(quality.hand_in_head_mm, actor.Head(), head, hand.Vertices());
      deepest(quality.arm_in_trunk_mm, actor.Trunk(), chest, hand.Vertices());
    }
  }
}

}  // namespace

double DeepestIn(const DistanceGrid& solid, const Isometry3d& solid_from_points,
                 const Eigen::Matrix3Xd& points) {
  double deepest = 0.0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3d p = solid_from_points * points.col(i);
    if ((p.array() < solid.Min().array()).any() || (p.array() > solid.Max().array()).any()) {
      continue;
    }
    deepest = std::max(deepest, -solid.Distance(p));
  }
  return deepest;
}

void MeasureAction(const ActionActor& actor, const ActionProp& prop, const Clip& clip,
                   ActionQuality& quality) {
  quality.frames = clip.NumFrames();
  MeasureHoldingHands(actor, prop, clip, quality);
  MeasureInBody(actor, prop, clip, quality);
  const Eigen::Matrix3Xd& rest = actor.Measures().rest_joints;
  const SolePoints soles(rest, actor.Measures().sole_y);
  const MotionQuality motion =
      MeasureQuality(rest, soles, BodyFrames(clip, rest), CapturedJointLimits());
  quality.beyond_limits = motion.beyond_limits_ratio;
  quality.skate = motion.skate_ratio;
  quality.max_acceleration = motion.max_acceleration;
}

std::pair<std::string, std::string> FaultOf(const ActionQuality& quality, std::string_view action) {
  const bool fast = action == "use" || action == "shake" || action == "brush" || action == "chop";
  const std::tuple<bool, const char*, std::string> faults[] = {
      {quality.worst_key > 60.0, "no comfortable pose",
       fmt::format("a key pose has cost {:.0f}", quality.worst_key)},
      {quality.hand_error_rad > 8.0 * kDegree, "wrist beyond its limits",
       fmt::format("by {:.0f} degrees", quality.hand_error_rad / kDegree)},
      {quality.shortfall_m > 0.02, "out of reach",
       fmt::format("by {:.0f} mm", 1000.0 * quality.shortfall_m)},
      {quality.penetrating > 0.02, "hand in object",
       fmt::format("{:.0f} % of frames over 2 mm, {:.1f} mm at most", 100.0 * quality.penetrating,
                   quality.deepest_mm)},
      {quality.contact < 0.98, "hand off object",
       fmt::format("in {:.0f} % of frames", 100.0 * (1.0 - quality.contact))},
      {quality.object_in_body_mm > 5.0, "object in body",
       fmt::format("{:.0f} mm", quality.object_in_body_mm)},
      {quality.hand_in_head_mm > 6.0, "hand in head",
       fmt::format("{:.0f} mm", quality.hand_in_head_mm)},
      {quality.arm_in_trunk_mm > 25.0, "arm in trunk",
       fmt::format("{:.0f} mm", quality.arm_in_trunk_mm)},
      {quality.beyond_limits > 0.03, "joints beyond captured limits",
       fmt::format("{:.1f} % of joints and frames", 100.0 * quality.beyond_limits)},
      {quality.skate > 0.02, "feet skate",
       fmt::format("in {:.0f} % of frames", 100.0 * quality.skate)},
      {quality.max_acceleration > (fast ? 120.0 : 60.0), "jerky",
       fmt::format("{:.0f} m/s^2", quality.max_acceleration)},
      {quality.slipped_mm > 15.0, "object slips",
       fmt::format("{:.0f} mm in the hand", quality.slipped_mm)}};
  for (const auto& [is, fault, detail] : faults) {
    if (is) return {fault, detail};
  }
  return {};
}

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;

constexpr int kSpine = 3;

// Interpolates between two directions along the shortest arc.
Vector3d Slerp(const Vector3d& from, const Vector3d& to, double share) {
  return Quaterniond::Identity().slerp(share, RotationBetween(from, to)) * from;
}

}  // namespace

Vector3d GazeAt(const ActionScript& script, double time_s, const Vector3d& eyes,
                const Vector3d& object) {
  const Vector3d ahead = -Vector3d::UnitY();
  Vector3d face = ahead;
  for (const GazeKey& key : script.gaze) {
    if (time_s < key.begin_s) continue;
    const Vector3d wanted = key.at_object ? Vector3d((object - eyes).normalized())
                                          : Vector3d(key.direction.normalized());
    const double come =
        key.duration_s > 0.0 ? MinimumJerk((time_s - key.begin_s) / key.duration_s) : 1.0;
    face = Slerp(face, Slerp(ahead, wanted, key.share), come);
  }
  return face;
}

Vector2d LeanAt(const ActionScript& script, double time_s) {
  Vector2d lean = Vector2d::Zero();
  for (const LeanKey& key : script.lean) {
    if (time_s < key.begin_s) continue;
    const double come =
        key.duration_s > 0.0 ? MinimumJerk((time_s - key.begin_s) / key.duration_s) : 1.0;
    lean += come * (Vector2d(key.forward, key.aside) - lean);
  }
  return lean;
}

Matrix3d LeanRotation(const Vector2d& lean) {
  return (Eigen::AngleAxisd(lean(1), Vector3d::UnitZ()) *
          Eigen::AngleAxisd(lean(0), Vector3d::UnitX()))
      .matrix();
}

NominalStance StanceAt(const BodyPlacement& start, const ActionScript& script, double time_s) {
  const Vector3d pivot = start.joints.col(kSpine);
  const Matrix3d turn = LeanRotation(LeanAt(script, time_s));
  const auto moved = [&](int joint) {
    return Vector3d(pivot + turn * (start.joints.col(joint) - pivot));
  };
  NominalStance stance;
  stance.chest = turn * start.rotation[kSpine3];
  stance.chest_position = moved(kSpine3);
  stance.right_shoulder = moved(17);
  stance.left_shoulder = moved(16);
  const Vector3d wanted =
      GazeAt(script, time_s, moved(kHead), moved(kHead) + Vector3d(-0.1, -0.35, -0.3));
  stance.head = RigidTransform(
      RotationBetween(start.rotation[kHead].col(2), wanted).matrix() * start.rotation[kHead],
      moved(kHead));
  return stance;
}

}  // namespace holdfast
