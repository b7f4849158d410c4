// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_script.h"
#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"
#include "solver/actions/action_clip.h"

namespace holdfast {

/// Fills in what can be measured on the finished clip (of a right-handed person): contact,
/// penetration, body, limits, skating.
void MeasureAction(const ActionActor& actor, const ActionProp& prop, const Clip& clip,
                   ActionQuality& quality);

/// Why a clip of this quality is not to be used: a few words, and with numbers. Both empty when it
/// may be.
struct ActionFault {
  std::string fault, detail;
};
ActionFault FaultOf(const ActionQuality& quality, std::string_view action);

/// Where a face is wanted to point at a time of a script; `object` is what it may look at, `eyes`
/// where from (world). Unit, world.
Eigen::Vector3d GazeAt(const ActionScript& script, double time_s, const Eigen::Vector3d& eyes,
                       const Eigen::Vector3d& object);

/// How the chest leans: forward, then to the left, radians.
Eigen::Vector2d LeanAt(const ActionScript& script, double time_s);

/// The turn (world) of a trunk that leans so; forward is -y.
Eigen::Matrix3d LeanRotation(const Eigen::Vector2d& lean);

/// Roughly where chest, shoulders and head are when a body does as the script says: the start's,
/// turned at the lowest spine joint, the face turned to where it is asked to look.
struct NominalStance {
  Eigen::Matrix3d chest = Eigen::Matrix3d::Identity();  ///< world rotation of spine3
  Eigen::Vector3d chest_position = Eigen::Vector3d::Zero();
  Eigen::Vector3d right_shoulder = Eigen::Vector3d::Zero();
  Eigen::Vector3d left_shoulder = Eigen::Vector3d::Zero();
  Eigen::Isometry3d head = Eigen::Isometry3d::Identity();

  const Eigen::Vector3d& Shoulder(Side side) const {
    return side == Side::kRight ? right_shoulder : left_shoulder;
  }
};
NominalStance StanceAt(const BodyPlacement& start, const ActionScript& script, double time_s);

}  // namespace holdfast
