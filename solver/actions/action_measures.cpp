// SPDX-License-Identifier: MIT
#include "solver/actions/action_measures.h"

#include <algorithm>
#include <cmath>
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

double DeepestIn(const DistanceGrid& grid, const Isometry3d& grid_from_points,
                 const Eigen::Matrix3Xd& points) {
  double deepest = 0.0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3d p = grid_from_points * points.col(i);
    if ((p.array() < grid.Min().array()).any() || (p.array() > grid.Max().array()).any()) continue;
    deepest = std::max(deepest, -grid.Distance(p));
  }
  return 1000.0 * deepest;
}

class ActionQualityMeter {
 public:
  ActionQualityMeter(const ActionActor& actor, const ActionProp& prop, const Clip& clip,
                     ActionQuality& quality)
      : actor_(actor), prop_(prop), clip_(clip), quality_(quality) {}

  void Measure() {
    quality_.frames = clip_.NumFrames();
    Hands();
    Body();
    Motion();
  }

 private:
  // From the grid: within 0.1 mm of the exact distances, in a hundredth of the time.
  Eigen::VectorXd DistancesTo(const Isometry3d& object_from_world,
                              const Eigen::Matrix3Xd& points) const {
    Eigen::VectorXd distances(points.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      distances(i) = prop_.fit.distance->Distance(object_from_world * points.col(i));
    }
    return distances;
  }

  // Vertices of holding hands in the object, per frame: one direction only, which is fast.
  void Hands() {
    int penetrating = 0, touching = 0, held = 0;
    std::vector<HandState> states = {HandState(actor_.Hand(Side::kRight)),
                                     HandState(actor_.Hand(Side::kLeft))};
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      bool deep = false, touches = false;
      held += clip_.holding_hand[static_cast<std::size_t>(t)] != 0 ? 1 : 0;
      for (HandState& state : states) {
        const Side side = state.Hand().HandSide();
        if ((clip_.holding_hand[static_cast<std::size_t>(t)] & HoldingBit(side)) == 0) continue;
        const JointPose& pose = clip_.pose[static_cast<std::size_t>(t)];
        state.SetBody(pose, clip_.trans.col(t));
        state.Evaluate(FingersOf(pose, side), false);
        const ContactMetrics contact =
            ContactFromDistances(DistancesTo(clip_.object->Pose(t).inverse(), state.Vertices()));
        quality_.deepest_mm = std::max(quality_.deepest_mm, contact.max_penetration_mm);
        deep |= contact.max_penetration_mm > kDeep_mm;
        touches |= contact.in_contact;
      }
      penetrating += deep ? 1 : 0;
      touching += touches ? 1 : 0;
    }
    quality_.penetrating = static_cast<double>(penetrating) / clip_.NumFrames();
    quality_.contact = static_cast<double>(touching) / std::max(1, held);
  }

  // The object in the rest of the body, and hands and forearms in head and trunk.
  void Body() {
    BodyState skin, forearms;
    std::vector<HandState> hands = {HandState(actor_.Hand(Side::kRight)),
                                    HandState(actor_.Hand(Side::kLeft))};
    for (int t = 0; t < clip_.NumFrames(); t += kEvery) {
      const JointPose& pose = clip_.pose[static_cast<std::size_t>(t)];
      Forward(actor_.Skin(), pose, clip_.trans.col(t), skin);
      quality_.object_in_body_mm =
          std::max(quality_.object_in_body_mm,
                   DeepestIn(*prop_.fit.distance, clip_.object->Pose(t).inverse(), skin.vertices));
      const Isometry3d head = skin.WorldFromJoint(kHead).inverse();
      const Isometry3d chest = skin.WorldFromJoint(kSpine3).inverse();
      Forward(actor_.Forearms(), pose, clip_.trans.col(t), forearms);
      double in_trunk = DeepestIn(actor_.Trunk(), chest, forearms.vertices);
      for (HandState& hand : hands) {
        hand.SetBody(pose, clip_.trans.col(t));
        hand.Evaluate(FingersOf(pose, hand.Hand().HandSide()), false);
        quality_.hand_in_head_mm = std::max(quality_.hand_in_head_mm,
                                            DeepestIn(actor_.Person().head, head, hand.Vertices()));
        in_trunk = std::max(in_trunk, DeepestIn(actor_.Trunk(), chest, hand.Vertices()));
      }
      quality_.arm_in_trunk_mm = std::max(quality_.arm_in_trunk_mm, in_trunk);
    }
  }

  void Motion() {
    const Eigen::Matrix3Xd& rest = actor_.Measures().rest_joints;
    const SolePoints soles(rest, actor_.Measures().sole_y);
    const MotionQuality motion =
        MeasureQuality(rest, soles, BodyFrames(clip_, rest), CapturedJointLimits());
    quality_.beyond_limits = motion.beyond_limits_ratio;
    quality_.skate = motion.skate_ratio;
    quality_.max_acceleration = motion.max_acceleration;
  }

  const ActionActor& actor_;
  const ActionProp& prop_;
  const Clip& clip_;
  ActionQuality& quality_;
};

}  // namespace

void MeasureAction(const ActionActor& actor, const ActionProp& prop, const Clip& clip,
                   ActionQuality& quality) {
  ActionQualityMeter(actor, prop, clip, quality).Measure();
}

ActionFault FaultOf(const ActionQuality& quality, std::string_view action) {
  const bool fast = action == "use" || action == "shake" || action == "brush" || action == "chop";
  if (quality.worst_key > 60.0) {
    return {"no comfortable pose", fmt::format("a key pose has cost {:.0f}", quality.worst_key)};
  }
  if (quality.hand_error_rad > 8.0 * kDegree) {
    return {"wrist beyond its limits",
            fmt::format("by {:.0f} degrees", quality.hand_error_rad / kDegree)};
  }
  if (quality.shortfall_m > 0.02) {
    return {"out of reach", fmt::format("by {:.0f} mm", 1000.0 * quality.shortfall_m)};
  }
  if (quality.penetrating > 0.02) {
    return {"hand in object", fmt::format("{:.0f} % of frames over 2 mm, {:.1f} mm at most",
                                          100.0 * quality.penetrating, quality.deepest_mm)};
  }
  if (quality.contact < 0.98) {
    return {"hand off object",
            fmt::format("in {:.0f} % of frames", 100.0 * (1.0 - quality.contact))};
  }
  if (quality.object_in_body_mm > 5.0) {
    return {"object in body", fmt::format("{:.0f} mm", quality.object_in_body_mm)};
  }
  if (quality.hand_in_head_mm > 6.0) {
    return {"hand in head", fmt::format("{:.0f} mm", quality.hand_in_head_mm)};
  }
  if (quality.arm_in_trunk_mm > 25.0) {
    return {"arm in trunk", fmt::format("{:.0f} mm", quality.arm_in_trunk_mm)};
  }
  if (quality.beyond_limits > 0.03) {
    return {"joints beyond captured limits",
            fmt::format("{:.1f} % of joints and frames", 100.0 * quality.beyond_limits)};
  }
  if (quality.skate > 0.02) {
    return {"feet skate", fmt::format("in {:.0f} % of frames", 100.0 * quality.skate)};
  }
  if (quality.max_acceleration > (fast ? 120.0 : 60.0)) {
    return {"jerky", fmt::format("{:.0f} m/s^2", quality.max_acceleration)};
  }
  if (quality.slipped_mm > 15.0) {
    return {"object slips", fmt::format("{:.0f} mm in the hand", quality.slipped_mm)};
  }
  return {};
}

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

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
