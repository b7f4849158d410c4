// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_script.h"
#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/actions/action_clip.h"

namespace holdfast {

/// Measures the finished clip (of a right-handed person): contact, penetration, body, limits,
/// skating.
void MeasureAction(const ActionActor& actor, const ActionProp& prop, const Clip& clip,
                   ActionQuality& quality);

/// Why a clip of this quality is rejected: brief, and with numbers. Both empty if it is accepted.
std::pair<std::string, std::string> FaultOf(const ActionQuality& quality, std::string_view action);

/// Depth of the deepest of `points` in a solid, meters; 0 if none is inside.
double DeepestIn(const DistanceGrid& solid, const Eigen::Isometry3d& solid_from_points,
                 const Eigen::Matrix3Xd& points);

/// Target direction of the face at a time of a script: unit vector, world. `object`: what the
/// person may look at; `eyes`: position of the eyes (world).
Eigen::Vector3d GazeAt(const ActionScript& script, double time_s, const Eigen::Vector3d& eyes,
                       const Eigen::Vector3d& object);

/// Lean of the chest: forward, then to the left, radians.
Eigen::Vector2d LeanAt(const ActionScript& script, double time_s);

/// Rotation (world) of a trunk with this lean; forward is -y.
Eigen::Matrix3d LeanRotation(const Eigen::Vector2d& lean);

/// Approximate chest, shoulders and head of a body that follows the script: those of the start,
/// rotated about the lowest spine joint, with the face turned to its target.
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
