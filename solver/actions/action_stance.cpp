// SPDX-License-Identifier: MIT
#include "solver/actions/action_stance.h"

#include <cmath>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSpine = 3;

// Between two directions, by the shortest arc.
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
