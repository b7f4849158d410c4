// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string_view>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "solver/grasp/grasp.h"

namespace holdfast {

struct GraspTransferOptions {
  /// Maximum correction of a wrist that counts as unchanged. Corrections are a distance plus
  /// `lever_m` times an angle.
  double small_correction_m = 0.04;
  double lever_m = 0.10;
  double correction_weight = 8.0;  ///< score penalty per meter of correction
  /// Allowed overlap of the receiving and the giving hand's skin: hands are soft.
  double max_hand_overlap_m = 0.004;
  double max_penetration_m = 0.002;         ///< of the hand in the object
  std::shared_ptr<const GraspPlace> place;  ///< where the receiving hand may touch; null: anywhere
  int closings = 24;    ///< further placements to close fingers on at a time, nearest first
  int refinements = 8;  ///< best of these to refine and measure exactly
  std::uint64_t seed = 0;
  int threads = 1;  ///< the result does not depend on it
};

struct GraspTransfer {
  bool found = false;  ///< clean, firm and clear of the giving hand; else the least bad try
  /// Source of the grasp: "mirrored" (the giving hand's fingers, mirrored and closed again at the
  /// given wrist), "reflected" (the giving hand's grasp, mirrored by a symmetry of the object) or
  /// "placed" (the nearest grasp for which object and other hand leave room).
  std::string_view method = "mirrored";
  Grasp grasp;  ///< of the receiving hand
  /// Correction of the wrist from its given pose to the grasp.
  double correction_m = 0.0;
  double correction_rad = 0.0;
  double hand_overlap_mm = 0.0;  ///< receiving hand's skin in the giving hand
  std::string_view refused;      ///< why `found` is false
};

struct TransferScene;

/// A hand that is to receive an object: precomputes what depends on neither the giver nor the
/// moment. Const and shared by threads afterwards; the arguments must outlive it.
class GraspReceiver {
 public:
  GraspReceiver(const HandModel& receiver, const TriangleMesh& object,
                const SignedDistance& surface, const DistanceGrid& distance,
                const GraspTransferOptions& options = {});
  ~GraspReceiver();

  /// TransferGrasp from this giver. Throws Error if both hands are of one side.
  GraspTransfer TakeOver(const HandModel& giver, const FingerPose& giver_fingers,
                         const Eigen::Isometry3d& giver_from_object,
                         const Eigen::Isometry3d& receiver_from_object) const;

  /// Minimum wrist correction, meters, for a place that the giving hand leaves free, before fingers
  /// are closed; 0.5 if there is none. Fast.
  double LeastCorrection(const HandAnatomy& giver, const FingerPose& giver_fingers,
                         const Eigen::Isometry3d& giver_from_object,
                         const Eigen::Isometry3d& receiver_from_object) const;

 private:
  std::unique_ptr<const TransferScene> scene_;
};

/// Returns the grasp with which the receiving hand takes the object while the giving hand still
/// holds it. The giver's optimized fingers are mirrored (same anatomical angles), opened, and
/// closed on the object at the clip's wrist pose. If this gives no clean grasp, whole grasps are
/// tried: the open hand at the clip's wrist, slightly rotated and moved to the object; the giver's,
/// reflected by symmetry planes of the object; and any that the object allows (FindOppositions,
/// GraspPlacer). Proximity to the wrist outweighs small score differences. The giving hand is an
/// obstacle throughout.
///
/// `giver_fingers` and `giver_from_object` are the giver's grasp; `receiver_from_object` uses the
/// clip's wrist of the receiver. Throws Error if both hands are of one side.
GraspTransfer TransferGrasp(const HandModel& giver, const FingerPose& giver_fingers,
                            const Eigen::Isometry3d& giver_from_object, const HandModel& receiver,
                            const Eigen::Isometry3d& receiver_from_object,
                            const TriangleMesh& object, const SignedDistance& surface,
                            const DistanceGrid& distance, const GraspTransferOptions& options = {});

/// Finger pose of the other hand with the same anatomical angles.
FingerPose MirrorFingers(const FingerPose& fingers);

}  // namespace holdfast
