// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_script.h"
#include "generator/actions/face_marks.h"
#include "generator/matching/body_frame.h"
#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/grasp/grasp.h"

namespace holdfast {

/// An object as actions are made with it, const and shared.
struct ActionObject {
  const TriangleMesh& mesh;
  const SignedDistance& surface;
  const DistanceGrid& distance;
};

/// Ways in which a hand can hold an object: clean grasps (CloseHand's), best first, no two nearly
/// alike (wrists 2 cm or 20 degrees apart). Up is wherever a hand at a table has it. Empty when the
/// hand cannot hold it; `status` tells why. The same on any number of `threads`.
std::vector<Grasp> FindActionGrasps(const HandModel& hand, const ActionObject& object,
                                    std::uint64_t seed, int most, GraspStatus* status = nullptr,
                                    int threads = 1);

/// Ways in which a hand holds a tool that it works hard with: the grip in the palm, the thumb's
/// side towards the head, wherever up is; not how it is picked up from a table. Empty where there
/// are none.
std::vector<Grasp> FindToolGrips(const HandModel& hand, const ActionObject& object,
                                 std::uint64_t seed, int most, int threads = 1);

/// Adds to each grasp of an object with two sides (ObjectMarks::two_sided) the same with the object
/// turned over in the hand. From above, a right hand takes a hammer that lies on one side with the
/// face to the front, and one that lies on the other with the claw there.
void AddTurnedOver(const ObjectMarks& marks, std::vector<Grasp>& grasps);

/// The hand's skin with a grasp's fingers, in the wrist's frame: every `every`-th vertex (3 x n).
Eigen::Matrix3Xd SkinInWrist(const HandModel& hand, const FingerPose& fingers, int every);

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
///   discomfort of the arm (ArmChoice) + (meters it is too short / 2 cm)^2 + (meters pushed off the
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
