// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_script.h"
#include "generator/matching/body_frame.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/actions/action_grasps.h"
#include "solver/body_ik/arm_ik.h"

namespace holdfast {

/// A person who acts: what stays the same from clip to clip. `head` are the signed distances of
/// FaceMarks::head.
struct ActionPerson {
  ArmIk right, left;
  const DistanceGrid& head;

  const ArmIk& Arm(Side side) const { return side == Side::kRight ? right : left; }
};

/// One way of holding: right hand, and for offhand the left too.
struct ActionGrasp {
  const Grasp* right = nullptr;
  const Grasp* left = nullptr;
  Eigen::Matrix3Xd right_skin, left_skin;  ///< SkinInWrist, a few of them; right alone is needed

  const Grasp* Of(Side side) const { return side == Side::kRight ? right : left; }
};

/// Poses of the object at the keys of a script, relative to their anchors.
struct ActionChoice {
  std::size_t grasp = 0;  ///< which of the grasps given
  std::vector<Eigen::Isometry3d> keys;
  double cost = 0.0;
  double worst_key = 0.0;  ///< cost of the least comfortable key
};

/// Which of the ways of holding, and which of the poses at each key, suit the arms best. Least sum
/// over keys of
///
///   discomfort of the arm (ArmChoice) + (metres it is too short / 2 cm)^2 + (metres pushed off the
///   head / 1 cm)^2 + (how deep hand or object is in the head / 2 mm)^2 + how deep hand or forearm
///   is in the table
///
/// and over ways between keys of (turn / 60 degrees)^2, or where turning is the point ((turn -
/// wanted) / 15 degrees)^2: by dynamic programming for each grasp. Shoulder and head at a key are
/// those of `start` leant and turned as the script says. `offsets`: added to each grasp's cost, for
/// variety. `object_points` (3 x n): samples of its surface, its frame. Throws Error for no grasps.
ActionChoice ChooseKeys(const ActionPerson& person, const BodyPlacement& start,
                        const ActionScript& script, std::span<const ActionGrasp> grasps,
                        std::span<const double> offsets, const Eigen::Matrix3Xd& object_points);

/// The hands that hold at a key.
std::array<bool, 2> HoldersAt(const ActionScript& script, int key);  ///< right, left

}  // namespace holdfast
