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
  int spans = 80;             ///< different pairs of opposed places on the object
  int closings = 16;          ///< of them, the nearest to where the hands are, that hands close on
  double max_width_m = 0.60;  ///< between the palms
  double max_penetration_m = 0.002;
  double touch_distance_m = 0.002;  ///< skin nearer than this touches
  double upright_weight = 3.0;      ///< of 1 - cosine, against the wrists' turning, in radians
  WristLimits wrist;                ///< what the arms may be asked for
  /// Both palms are there: on its region, on either side of its point. Null: wherever it suits.
  std::shared_ptr<const GraspPlace> place;
  std::uint64_t seed = 0;
  int threads = 1;  ///< the result is the same for any number
};

/// An object between both hands of a body in one pose.
struct BothHandsGrasp {
  GraspStatus status = GraspStatus::kNothingToGrasp;
  std::array<Grasp, 2> hands;  ///< right, left: each relative to its own wrist
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  JointPose pose = JointPose::Zero();      ///< arms moved to reach, fingers closed
  std::array<double, 2> wrist_shift_mm{};  ///< right, left: from the pose that was given
  std::array<double, 2> wrist_turn_deg{};
  double width_m = 0.0;     ///< between the palms
  double upright = 0.0;     ///< cosine of the object's z with world's
  double in_body_mm = 0.0;  ///< deepest point of trunk, head, legs and upper arms in the object
};

/// Puts an object (z up, its own frame, meters) between the two hands of `pose`: opposed places
/// whose span and direction suit where the hands are, the object as upright as they allow and far
/// enough from the body not to touch it, a palm flat on either side, fingers closed and refined as
/// for one hand. The object is rigid, so the wrists follow it: shoulder, elbow and wrist of both
/// arms change by little (MoveWrist), within the limits of elbow and wrist.
///
/// `body` and both hands are the same person; `distance` are the object's signed distances.
/// When the status is not kFound, the pose is the one given.
BothHandsGrasp HoldInBothHands(const HandModel& right, const HandModel& left,
                               const BodySurface& body, const JointPose& pose,
                               const Eigen::Vector3d& trans, const TriangleMesh& object,
                               const DistanceGrid& distance, const BothHandsOptions& options = {});

}  // namespace holdfast
