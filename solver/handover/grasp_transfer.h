// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string_view>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "solver/grasp/grasp.h"

namespace holdfast {

struct GraspTransferOptions {
  /// A wrist that is corrected by more than this has not been met where it is. Corrections are a
  /// distance plus `lever_m` times an angle.
  double small_correction_m = 0.04;
  double lever_m = 0.10;
  double correction_weight = 8.0;  ///< of score that a meter of correction is worth
  /// The receiving hand's skin and the giving hand's may overlap by this: hands are soft.
  double max_hand_overlap_m = 0.004;
  double max_penetration_m = 0.002;         ///< of the hand in the object
  std::shared_ptr<const GraspPlace> place;  ///< where the receiving hand may touch; null: anywhere
  int closings = 24;    ///< other placements that fingers are closed for at a time, nearest first
  int refinements = 8;  ///< of these, the best, refined and measured exactly
  std::uint64_t seed = 0;
  int threads = 1;  ///< the result is the same for any number
};

/// Where the receiving hand's grasp comes from.
enum class TransferMethod {
  kMirrored,   ///< the giving hand's fingers, mirrored and closed anew where the wrist is
  kReflected,  ///< the giving hand's whole grasp, mirrored by a symmetry of the object
  kPlaced,     ///< the nearest grasp that the object and the other hand leave room for
};
std::string_view MethodName(TransferMethod method);

struct GraspTransfer {
  bool found = false;  ///< clean and firm, clear of the giving hand; else the least bad try
  TransferMethod method = TransferMethod::kMirrored;
  Grasp grasp;  ///< of the receiving hand
  /// What takes the wrist from where it was given to where the grasp needs it.
  double correction_m = 0.0;
  double correction_rad = 0.0;
  double hand_overlap_mm = 0.0;   ///< receiving hand's skin in the giving hand
  double thumb_opposition = 0.0;  ///< 1: thumb presses straight against a finger; 0: it does not
  std::string_view refused;       ///< why `found` is false
};

struct TransferScene;

/// A hand that is to take an object over: what depends on neither the giver nor the moment is
/// worked out once. Const and shared by threads afterwards; what it is given must outlive it.
class GraspReceiver {
 public:
  GraspReceiver(const HandModel& receiver, const TriangleMesh& object,
                const SignedDistance& surface, const DistanceGrid& distance,
                const GraspTransferOptions& options = {});
  ~GraspReceiver();

  /// TransferGrasp from this giver. Throws Error when both hands are of one side.
  GraspTransfer TakeOver(const HandModel& giver, const FingerPose& giver_fingers,
                         const Eigen::Isometry3d& giver_from_object,
                         const Eigen::Isometry3d& receiver_from_object) const;

  /// Fast: by how little, meters, the wrist would have to be corrected for a place that the giving
  /// hand leaves free, before fingers are closed; 0.5 where there is none.
  double LeastCorrection(const HandAnatomy& giver, const FingerPose& giver_fingers,
                         const Eigen::Isometry3d& giver_from_object,
                         const Eigen::Isometry3d& receiver_from_object) const;

 private:
  std::unique_ptr<const TransferScene> scene_;
};

/// The grasp that the receiving hand takes an object over with, while the giving hand still holds
/// it. The optimized fingers of the giver are mirrored (their angles are the same in anatomical
/// terms), opened, and closed on the object as it is, at the wrist pose that the clip has. Where
/// that is no clean grasp, whole grasps are tried: the open hand at the clip's wrist, turned a
/// little and put to the object; the giver's, reflected by planes the object is symmetric about;
/// and any that the object allows (FindOppositions, GraspPlacer). The one nearest to the wrist wins
/// over those a little better. The giving hand is an obstacle all along.
///
/// `giver_grasp` is that of `giver`, the other side's hand; `receiver_from_object` is the clip's
/// wrist of the receiving hand. Throws Error when both hands are of one side.
GraspTransfer TransferGrasp(const HandModel& giver, const FingerPose& giver_fingers,
                            const Eigen::Isometry3d& giver_from_object, const HandModel& receiver,
                            const Eigen::Isometry3d& receiver_from_object,
                            const TriangleMesh& object, const SignedDistance& surface,
                            const DistanceGrid& distance, const GraspTransferOptions& options = {});

/// A finger pose on the other hand: the same angles in anatomical terms.
FingerPose MirrorFingers(const FingerPose& fingers);

}  // namespace holdfast
