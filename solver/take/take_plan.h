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

/// What is to be taken, where it stands, and where it shall go. World: z up, ground z = 0.
struct TakeRequest {
  Side side = Side::kRight;
  /// Middles of the object's bottom: where it stands, then where it shall be in the hand.
  std::vector<Eigen::Vector3d> places;
  std::optional<double> object_yaw_rad;  ///< of the standing object; empty: what suits the hand
  std::optional<GraspStyle> style;       ///< empty: any
  /// Where the person comes from: the take is expected along the way from here to the object.
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();
  std::uint64_t seed = 1;
  int threads = 1;
};

/// The object, in its own frame (z up when it stands), meters.
struct TakeObject {
  const TriangleMesh& mesh;
  const SignedDistance& surface;
  const DistanceGrid& distance;

  /// Middle of its bounding box at its least z: what is put on the table.
  Eigen::Vector3d BottomMiddle() const;
  /// Upright on `bottom_middle`, turned about the vertical.
  Eigen::Isometry3d Upright(const Eigen::Vector3d& bottom_middle, double yaw_rad) const;
};

/// A candidate of a plan: a grasp that a hand at the table can take, and how good it is.
struct TakeCandidate {
  Grasp grasp;
  HandApproach approach;
  double yaw_rad = 0.0;  ///< of the object on the table
  ArmChoice arm;         ///< expected (TakePlan) or real (TakeMotion)
  double score = 0.0;    ///< larger is better: ScoreTake
  std::string fault;     ///< why it is not to be used; empty when it is

  /// Where the wrist is when the object is at `world_from_object`.
  Eigen::Isometry3d WristFor(const Eigen::Isometry3d& world_from_object) const {
    return world_from_object * grasp.wrist_from_object.inverse();
  }
};

/// A place for the wrist joint.
struct TakeGoal {
  Eigen::Vector3d wrist = Eigen::Vector3d::Zero();       ///< world, meters
  Eigen::Matrix3d hand = Eigen::Matrix3d::Identity();    ///< wished world rotation of the wrist
  Eigen::Vector3d approach = -Eigen::Vector3d::UnitZ();  ///< unit: how the hand comes there
  double stay_s = 0.0;                                   ///< how long the body should stay for it
};

/// Made before the motion: where to stand, what to reach for, and how to take it.
struct TakePlan {
  Side side = Side::kRight;
  std::vector<Eigen::Vector3d> places;  ///< as asked
  bool yaw_is_free = true;
  double approach_yaw_rad = 0.0;                      ///< direction of walking at the take, from +x
  TakeCandidate take;                                 ///< the best of `candidates`
  std::vector<TakeCandidate> candidates;              ///< best first; for when the body stands
  GraspStatus status = GraspStatus::kNothingToGrasp;  ///< of the search for grasps
  SideTable table;                                    ///< where it is expected to stand
  /// For the motion, one for each place: the grasp, then the carries. Positions count; rotations
  /// are wishes, and the arm is made anew afterwards: a wrist within 10 cm is near enough.
  std::vector<TakeGoal> goals;

  bool Found() const { return !candidates.empty(); }
};

/// A body's motion for a plan, from any generator: input of MakeTakeMotion.
struct TakeBodyMotion {
  Eigen::MatrixXd states;   ///< (135 x F), as wandr::StatesOfClip has them, 30 fps
  std::vector<int> frames;  ///< for each goal, the frame at which the wrist is there
};

/// How good it is to take the object so, with this shoulder (world) and chest (rotation of spine3):
///
///   score = grasp.score - 0.5 discomfort of the arm (ArmChoice) - 0.15 through_mm - 0.1 below_mm
///           - 10 (share of the arm's length beyond nine tenths) - 20 (meters of forearm in the
///           table, where it is over it)
///
/// `fault` where it cannot be: the wrist more than 3 degrees beyond its limits, more than 12 cm out
/// of reach, hand over 6 mm below the table's top, forearm over 2 cm in it, fingers over 6 mm
/// through the object. Sets `arm`, `score` and `fault`.
void ScoreTake(const ArmIk& arm, const Eigen::Vector3d& shoulder, const Eigen::Matrix3d& chest,
               const Eigen::Isometry3d& world_from_object, double table_z, TakeCandidate& take);

/// Searches grasps with CloseHand, up wherever a hand at a table may turn, and scores each at each
/// yaw (every 10 degrees) from where the person is expected to stand: in front of the object, along
/// the way from `pelvis`, the shoulder a comfortable reach away. `Found()` tells whether there is
/// one; `status` why not. Throws Error without places, or places that are not finite or below the
/// ground. `progress` as CloseHand's.
TakePlan PlanTake(const TakeRequest& request, const HandModel& hand, const TakeObject& object,
                  const GraspProgress& progress = {});

}  // namespace holdfast
