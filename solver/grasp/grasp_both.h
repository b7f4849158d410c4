// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "geometry/body/body_model.h"
#include "solver/grasp/grasp.h"

namespace holdfast {

struct BothHandsOptions {
  int spans = 80;             ///< distinct antipodal pairs on the object
  int closings = 16;          ///< of these, nearest to the hands, to close hands on
  double max_width_m = 0.60;  ///< between the palms
  double max_penetration_m = 0.002;
  double touch_distance_m = 0.002;  ///< contact threshold for skin
  double upright_weight = 3.0;      ///< of 1 - cosine, relative to wrist rotation in radians
  WristLimits wrist;                ///< wrist limits of the arms
  /// Region for both palms, on either side of its point. Null: anywhere.
  std::shared_ptr<const GraspPlace> place;
  std::uint64_t seed = 0;
  int threads = 1;  ///< the result does not depend on it
};

/// An object between both hands of a body in one pose.
struct BothHandsGrasp {
  GraspStatus status = GraspStatus::kNothingToGrasp;
  std::array<Grasp, 2> hands;  ///< right, left; each relative to its own wrist
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  JointPose pose = JointPose::Zero();      ///< arms moved to reach, fingers closed
  std::array<double, 2> wrist_shift_mm{};  ///< right, left: from the given pose
  std::array<double, 2> wrist_turn_deg{};
  double width_m = 0.0;     ///< between the palms
  double upright = 0.0;     ///< cosine of the object's z with world z
  double in_body_mm = 0.0;  ///< deepest point of trunk, head, legs and upper arms in the object
};

/// Places an object (z up, its own frame, meters) between the two hands of `pose`: antipodal places
/// whose span and direction suit the hands, the object as upright as they allow and far enough from
/// the body not to touch it. The palms lie flat on either side; fingers are closed and refined as
/// for one hand. The object is rigid and the wrists follow it: shoulder, elbow and wrist of both
/// arms change slightly (MoveWrist), within the limits of elbow and wrist.
///
/// `body` and both hands belong to the same person; `distance` holds the object's signed distances.
/// When the status is not kFound, the pose is the given one.
BothHandsGrasp HoldInBothHands(const HandModel& right, const HandModel& left,
                               const BodySurface& body, const JointPose& pose,
                               const Eigen::Vector3d& trans, const TriangleMesh& object,
                               const DistanceGrid& distance, const BothHandsOptions& options = {});

}  // namespace holdfast
