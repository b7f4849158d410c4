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

/// A hand at something that stands, in the wrist's frame.
struct HandAtTable {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();      ///< the world's, unit
  Eigen::Vector3d between = Eigen::Vector3d::Zero();  ///< of thumb and fingers, meters
  double table_m = 0.0;  ///< height of what it stands on along `up`, from the wrist
  /// What a place in the hand (wrist_from_object) with this skin (3 x N, wrist's frame) is worth
  /// besides the grasp's score.
  std::function<double(const Eigen::Isometry3d&, const Eigen::Matrix3Xd&)> also;
};

/// Closes a hand around something that stands upright on a table, at that height: places about
/// `between` and, where it is not round, turns about the vertical are tried (CloseFingers), the
/// best are refined (RefineGrasp, which may lean and lift it a little) and judged (Assess).
/// `status` is kFound, kNoCleanGrasp with the least bad one, or kNoRoom.
Grasp HoldStanding(const HandModel& hand, const HandAtTable& at, const PreparedObject& object,
                   const ObjectMarks& marks, std::uint64_t seed, GraspStatus& status);

}  // namespace holdfast
