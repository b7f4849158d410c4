// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/hand_approach.h"
#include "solver/take/take_table.h"

namespace holdfast {

/// The object to take, where it stands, and its targets. World: z up, ground z = 0.
struct TakeRequest {
  Side side = Side::kRight;
  /// Bottom centers of the object: where it stands, then its targets in the hand.
  std::vector<Eigen::Vector3d> places;
  std::optional<double> object_yaw_rad;  ///< of the standing object; empty: chosen for the hand
  std::optional<GraspStyle> style;       ///< empty: any
  /// Start of the person, who is expected to take the object on the line from here to it.
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();
  std::uint64_t seed = 1;
  int threads = 1;
};

/// The object, in its own frame (z up when standing), meters.
struct TakeObject {
  const TriangleMesh& mesh;
  const SignedDistance& surface;
  const DistanceGrid& distance;

  /// Center of its bounding box at minimum z: the point placed on the table.
  Eigen::Vector3d BottomMiddle() const;
  /// Pose upright on `bottom_middle`, with a yaw about the vertical.
  Eigen::Isometry3d Upright(const Eigen::Vector3d& bottom_middle, double yaw_rad) const;
};

/// A candidate of a plan: a grasp of a hand at the table, and its score.
struct TakeCandidate {
  Grasp grasp;
  HandApproach approach;
  double yaw_rad = 0.0;  ///< of the object on the table
  ArmChoice arm;         ///< expected (TakePlan) or actual (TakeMotion)
  double score = 0.0;    ///< larger is better: ScoreTake
  std::string fault;     ///< reason for rejection; empty if suitable

  /// Whether this is the better candidate: the suitable one, else that with the higher score.
  bool Beats(const TakeCandidate& other) const {
    return fault.empty() != other.fault.empty() ? fault.empty() : score > other.score;
  }
  /// Wrist pose for the object at `world_from_object`.
  Eigen::Isometry3d WristFor(const Eigen::Isometry3d& world_from_object) const {
    return world_from_object * grasp.wrist_from_object.inverse();
  }
};

/// A target of the wrist joint.
struct TakeGoal {
  Eigen::Vector3d wrist = Eigen::Vector3d::Zero();       ///< world, meters
  Eigen::Matrix3d hand = Eigen::Matrix3d::Identity();    ///< target world rotation of the wrist
  Eigen::Vector3d approach = -Eigen::Vector3d::UnitZ();  ///< unit approach direction of the hand
  double stay_s = 0.0;                                   ///< time that the body should stay
};

/// Computed before the motion: where to stand, what to reach for, and how to take it.
struct TakePlan {
  Side side = Side::kRight;
  std::vector<Eigen::Vector3d> places;  ///< as requested
  bool yaw_is_free = true;
  double approach_yaw_rad = 0.0;          ///< walking direction at the take, from +x
  TakeCandidate take;                     ///< the best of `candidates`
  std::vector<TakeCandidate> candidates;  ///< best first; for selection with the actual body
  GraspStatus status = GraspStatus::kNothingToGrasp;  ///< of the grasp search
  SideTable table;                                    ///< expected pose
  /// Goals for the motion, one per place: the grasp, then the carries. Positions matter; rotations
  /// are preferences, and the arm is solved again later: a wrist within 10 cm is close enough.
  std::vector<TakeGoal> goals;

  bool Found() const { return !candidates.empty(); }
};

/// A body motion for a plan, from any generator: input of MakeTakeMotion.
struct TakeBodyMotion {
  Eigen::MatrixXd states;   ///< (135 x F), as from wandr::StatesOfClip, 30 fps
  std::vector<int> frames;  ///< per goal: frame at which the wrist is there
};

/// Scores a take with this shoulder (world) and chest (rotation of spine3):
///
///   score = grasp.score - 0.5 discomfort of the arm (ArmChoice) - 0.15 through_mm - 0.1 below_mm
///           - 10 (fraction of the arm's length beyond 0.9) - 20 (depth of the forearm in the
///           table, meters, where it is above it)
///
/// `fault` if infeasible: wrist more than 3 degrees beyond its limits, more than 12 cm out of
/// reach, hand over 6 mm below the table's top, forearm over 2 cm in it, or fingers over 6 mm
/// through the object. Sets `arm`, `score` and `fault`.
void ScoreTake(const ArmIk& arm, const Eigen::Vector3d& shoulder, const Eigen::Matrix3d& chest,
               const Eigen::Isometry3d& world_from_object, double table_z, TakeCandidate& take);

/// Searches grasps with CloseHand, with the up directions of a hand at a table, and scores each at
/// each yaw (every 10 degrees) from the person's expected stance: in front of the object, on the
/// line from `pelvis`, the shoulder at a comfortable reach. `Found()` tells whether there is one,
/// `status` why not. Throws Error for no places, and places that are not finite or below the
/// ground. `progress` as for CloseHand.
TakePlan PlanTake(const TakeRequest& request, const HandModel& hand, const TakeObject& object,
                  const GraspProgress& progress = {});

}  // namespace holdfast
