// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>

#include <Eigen/Core>

#include "generator/actions/face_marks.h"
#include "geometry/body/hand_model.h"
#include "solver/fit/prepared_object.h"
#include "solver/grasp/grasp.h"

namespace holdfast {

/// A hand at an object that stands on a table, in the wrist frame.
struct HandAtTable {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();      ///< world up, unit
  Eigen::Vector3d between = Eigen::Vector3d::Zero();  ///< point between thumb and fingers, meters
  double table_m = 0.0;                               ///< table height along `up`, from the wrist
  /// Score of an object pose in the hand (wrist_from_object) with this skin (3 x N, wrist frame),
  /// added to the grasp's own score.
  std::function<double(const Eigen::Isometry3d&, const Eigen::Matrix3Xd&)> also;
};

/// Closes a hand around an object that stands upright on a table at that height. Tries positions
/// around `between` and, if the object is not round, rotations about the vertical (CloseFingers);
/// refines the best (RefineGrasp, which may tilt and lift the object slightly) and assesses them
/// (Assess). `status` is kFound, kNoCleanGrasp with the least bad grasp, or kNoRoom.
Grasp HoldStanding(const HandModel& hand, const HandAtTable& at, const PreparedObject& object,
                   const ObjectMarks& marks, std::uint64_t seed, GraspStatus& status);

}  // namespace holdfast
