// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_script.h"
#include "generator/actions/face_marks.h"
#include "generator/matching/body_frame.h"
#include "geometry/body/hand_model.h"
#include "solver/grasp/grasp.h"

namespace holdfast {

class ActionActor;
struct ActionProp;

/// Returns grasps accepted by CloseHand, best first, no two similar (wrists at least 2 cm or 20
/// degrees apart). The up direction covers orientations of a hand at a table. Empty if the hand
/// cannot hold the object; `status` gives the reason. Independent of `threads`.
std::vector<Grasp> FindActionGrasps(const HandModel& hand, const ActionProp& prop,
                                    std::uint64_t seed, int most, GraspStatus* status = nullptr,
                                    int threads = 1);

/// Returns grasps for heavy work with a tool: handle in the palm, thumb side towards the tool's
/// head, any up direction; not for picking it up from a table. Empty if there are none.
std::vector<Grasp> FindToolGrips(const HandModel& hand, const ActionProp& prop, std::uint64_t seed,
                                 int most, int threads = 1);

/// For an object with two sides (ObjectMarks::two_sided), adds each grasp with the object turned
/// over in the hand. From above, a right hand takes a hammer lying on one side with its face to the
/// front, and on the other side with its claw to the front.
void AddTurnedOver(const ObjectMarks& marks, std::vector<Grasp>& grasps);

/// The hand's skin with a grasp's fingers, in the wrist's frame: every `every`-th vertex (3 x n).
Eigen::Matrix3Xd SkinInWrist(const HandModel& hand, const FingerPose& fingers, int every);

/// A grasp of the right hand, and for offhand also of the left.
struct ActionGrasp {
  Grasp right;
  std::optional<Grasp> left;
  Eigen::Matrix3Xd right_skin;  ///< subsampled SkinInWrist

  const Grasp& Of(Side side) const { return side == Side::kRight ? right : *left; }
};

/// Poses of the object at the keys of a script, relative to their anchors.
struct ActionChoice {
  std::size_t grasp = 0;  ///< index of the given grasps
  std::vector<Eigen::Isometry3d> keys;
  double cost = 0.0;
  double worst_key = 0.0;  ///< cost of the least comfortable key
};

/// Selects the grasp and the poses at the keys that suit the arms best. Minimizes the sum over keys
/// of
///
///   discomfort of the arm (ArmChoice) + (shortfall of the arm / 2 cm)^2
///   + (push off the head / 1 cm)^2 + (depth of hand or object in the head / 2 mm)^2
///   + depth of hand or forearm in the table
///
/// and, between keys, of (rotation / 60 degrees)^2, or for scripted rotations ((rotation - target)
/// / 15 degrees)^2: by dynamic programming for each grasp. Shoulder and head at a key are those of
/// `start`, leaned and turned as scripted. `offsets`: added to each grasp's cost, for variety.
/// `object_points` (3 x n): surface samples in the object's frame. Throws Error for no grasps.
ActionChoice ChooseKeys(const ActionActor& actor, const BodyPlacement& start,
                        const ActionScript& script, std::span<const ActionGrasp> grasps,
                        std::span<const double> offsets, const Eigen::Matrix3Xd& object_points);

/// The hands that hold the object at a key.
std::array<bool, 2> HoldersAt(const ActionScript& script, int key);  ///< right, left

}  // namespace holdfast
