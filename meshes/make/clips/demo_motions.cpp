// SPDX-License-Identifier: MIT
#include "meshes/make/clips/demo_motions.h"

#include <cmath>
#include <cstdint>
#include <functional>

#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "generator/walk_statistics/motion_metrics.h"
#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The keys are laid out for the embedded body and scaled to others by their height to the neck.
constexpr double kDesignHeight = 1.403;

double Scale(const BodyMeasures& body) {
  return (body.rest_joints(1, 12) - body.sole_y) / kDesignHeight;
}

// A power grip holds a handle askew: its top leans this much from the thumb side to the fingers.
constexpr double kObliquity = 14.0 * kDegree;

// The hand around an upright cylinder, palm facing left and `inward` back to the person, the
// cylinder's top leaning `tilt` towards the person. Fingers point a little up (kObliquity).
Matrix3d Grip(double inward, double tilt) {
  const Vector3d fingers(std::sin(inward), -std::cos(inward), 0.0);
  const Matrix3d upright = HandOrientation(Side::kRight, fingers, Vector3d::UnitZ());
  return ExpSO3(-tilt * Vector3d::UnitX()) *  // from +z towards +y, the person's face
         upright * ExpSO3(kObliquity * Vector3d::UnitY());
}

// The embedded mug held by its handle, as `holdfast grasp mug` and `fit` hold it: its axis (unit,
// up) and the middle of its rim in the wrist's frame.
const Vector3d kMugAxis(-0.1283, -0.2541, 0.9586);
const Vector3d kMugRim(-0.0350, -0.0928, 0.0089);  // metres
constexpr double kMugRadius = 0.041;

// The hand that holds the mug so, the mug's top leaning `tilt` towards the person.
Matrix3d MugGrip(double inward, double tilt) {
  const Vector3d fingers(std::sin(inward), -std::cos(inward), 0.0);
  const Matrix3d level = HandOrientation(Side::kRight, fingers, Vector3d::UnitZ());
  const Vector3d up = level.transpose() * Vector3d::UnitZ();
  return ExpSO3(-tilt * Vector3d::UnitX()) * level *
         RotationBetween(kMugAxis, up).toRotationMatrix();
}

// Where the wrist must be for the rim of the mug to be at `lips`.
Vector3d WristForSip(const Vector3d& lips, const Matrix3d& hand) {
  const Vector3d axis = hand * kMugAxis;
  const Vector3d to_face = (Vector3d::UnitY() - axis.y() * axis).normalized();
  return lips - kMugRadius * to_face - hand * kMugRim;
}

// What the trunk and head do at a key.
struct Posture {
  double twist, lean;  // radians
  double shift;        // -1 right foot .. 1 left foot
  double give;         // metres
  double gaze = 1.0;
  double head_tilt = 0.0;  // radians
};

constexpr bool kStop = true, kPass = false;

ReachKey Key(double time_s, bool stops, const Vector3d& wrist, const Matrix3d& hand,
             const Posture& posture) {
  ReachKey key;
  key.time_s = time_s;
  key.wrist = wrist;
  key.hand = hand;
  key.rest = stops;
  key.torso_twist_rad = posture.twist;
  key.torso_lean_rad = posture.lean;
  key.weight_shift = posture.shift;
  key.knee_give_m = posture.give;
  key.gaze = posture.gaze;
  key.head_tilt_rad = posture.head_tilt;
  return key;
}

int FrameAt(const Clip& clip, double time_s) {
  return std::min(static_cast<int>(std::lround(time_s * clip.frame_rate)), clip.NumFrames() - 1);
}

Matrix3d WorldRotation(const JointPose& pose, int joint) {
  Matrix3d rotation = Matrix3d::Identity();
  for (int j = joint; j >= 0; j = kJointParents[j]) rotation = ExpSO3(pose.col(j)) * rotation;
  return rotation;
}

// A place of the head (head joint's frame) in the world.
Vector3d AtHead(const BodyMeasures& body, const Clip& clip, int frame, const Vector3d& place) {
  const Clip one = Slice(clip, frame, frame + 1);
  const JointPositions joints = JointTrajectory(one, body.rest_joints).front();
  return joints.col(kHead) + WorldRotation(one.pose[0], kHead) * place;
}

// Makes the motion a few times over. What the wrist cannot do is given up in the keys themselves,
// so that nothing runs into a limit between them; `adjust` may move keys to what a round has shown.
DemoMotion Settle(const BodyMeasures& body, std::vector<ReachKey>& keys, std::uint64_t seed,
                  const std::function<void(const Clip&)>& adjust) {
  ScriptedReachOptions options;
  options.seed = seed;
  DemoMotion demo;
  for (int round = 0; round < 8; ++round) {
    demo.clip = MakeReachMotion(body, keys, options, &demo.report);
    for (ReachKey& key : keys) {
      const JointPose& pose = demo.clip.pose[FrameAt(demo.clip, key.time_s)];
      key.hand = WorldRotation(pose, WristJoint(Side::kRight));
    }
    adjust(demo.clip);
  }
  demo.clip.holding_hand.assign(demo.clip.pose.size(), kHoldsRight);
  return demo;
}

}  // namespace

DemoMotion DrinkMotion(const BodyMeasures& body, const Vector3d& mouth) {
  const double scale = Scale(body);
  const auto at = [&](double x, double y, double z) -> Vector3d {
    return scale * Vector3d(x, y, z);
  };
  // clang-format off
  std::vector<ReachKey> keys = {
      Key(0.00, kStop, at(-0.15, -0.30, 1.05), MugGrip(0.55, 0.0), {-0.03, 0.10, -0.15, 0.002}),
      Key(0.20, kStop, at(-0.15, -0.30, 1.05), MugGrip(0.55, 0.0), {-0.03, 0.10, -0.15, 0.002}),
      Key(0.80, kPass, at(-0.16, -0.31, 1.24), MugGrip(0.80, 0.04), {0.0, 0.04, -0.25, 0.001, 0.9}),
      Key(1.50, kStop, at(-0.10, -0.19, 1.46), MugGrip(1.15, 0.34), {0.02, 0.0, -0.30, 0.0, 0.45}),
      Key(2.00, kStop, at(-0.10, -0.19, 1.46), MugGrip(1.20, 0.72), {0.02, -0.03, -0.3, 0, 0.3, 0.2}),
      Key(2.50, kPass, at(-0.10, -0.19, 1.46), MugGrip(1.15, 0.34), {0.02, 0.0, -0.25, 0, 0.45, 0.04}),
      Key(3.10, kPass, at(-0.06, -0.34, 1.22), MugGrip(0.95, 0.03), {0.22, 0.04, 0.10, 0.001, 0.85}),
      Key(4.20, kStop, at(0.17, -0.33, 1.05), MugGrip(1.15, 0.0), {0.55, 0.12, 0.50, 0.004}),
      Key(4.80, kStop, at(0.17, -0.33, 1.05), MugGrip(1.15, 0.0), {0.53, 0.12, 0.45, 0.003})};
  // clang-format on

  // Where the mouth is depends on the motion: rounds settle it.
  const Vector3d lips = mouth + Vector3d(0.0, -0.004, 0.004);  // off the skin
  return Settle(body, keys, 1, [&](const Clip& clip) {
    for (ReachKey& key : keys) {
      if (key.time_s < 1.4 || key.time_s > 2.6) continue;
      key.wrist = WristForSip(AtHead(body, clip, FrameAt(clip, key.time_s), lips), key.hand);
    }
  });
}

DemoMotion InspectMotion(const BodyMeasures& body) {
  const double scale = Scale(body);
  const auto at = [&](double x, double y, double z) -> Vector3d {
    return scale * Vector3d(x, y, z);
  };
  // From the middle pose, turns about the forearm (roll), to the palm (bend) and sideways (tip).
  const Matrix3d middle = Grip(0.95, 0.15);
  const auto turned = [&](double roll, double bend, double tip) -> Matrix3d {
    return middle * ExpSO3(kDegree * roll * Vector3d::UnitX()) *
           ExpSO3(kDegree * bend * Vector3d::UnitZ()) * ExpSO3(kDegree * tip * Vector3d::UnitY());
  };
  // clang-format off
  std::vector<ReachKey> keys = {
      Key(0.00, kStop, at(-0.14, -0.30, 1.10), Grip(0.60, 0.0), {0.0, 0.08, 0.1, 0.003}),
      Key(0.70, kStop, at(-0.07, -0.31, 1.33), middle, {0.05, 0.03, 0.2, 0.0}),
      Key(1.20, kPass, at(-0.07, -0.30, 1.34), turned(-58, 0, 5), {0.05, 0.03, 0.2, 0.0}),
      Key(1.70, kPass, at(-0.06, -0.31, 1.34), turned(52, 5, 5), {0.06, 0.04, 0.1, 0.0}),
      Key(2.20, kPass, at(-0.05, -0.30, 1.33), turned(0, 46, 0), {0.04, 0.04, 0.0, 0.0}),
      Key(2.70, kPass, at(-0.08, -0.30, 1.34), turned(0, -42, 0), {0.02, 0.04, -0.1, 0.002}),
      Key(3.20, kPass, at(-0.08, -0.29, 1.34), turned(-15, 0, 16), {0.02, 0.05, -0.2, 0.002}),
      Key(3.70, kPass, at(-0.07, -0.29, 1.33), turned(-35, 15, -24), {0.04, 0.05, -0.2, 0.002}),
      Key(4.20, kPass, at(-0.07, -0.31, 1.33), turned(25, -12, 5), {0.04, 0.04, -0.1, 0.0}),
      Key(5.00, kStop, at(-0.14, -0.30, 1.12), Grip(0.60, 0.0), {0.0, 0.08, 0.0, 0.003})};
  // clang-format on
  return Settle(body, keys, 2, [](const Clip&) {});
}

}  // namespace holdfast
