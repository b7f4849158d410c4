// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/fit/fit.h"
#include "solver/grasp/grasp.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/handover/grasp_transfer.h"

namespace holdfast {

/// Maximum deviation of a wrist from the clip.
struct WristChange {
  double moved_m = 0.0, turned_rad = 0.0;
};

/// One handover.
struct Handover {
  int frame = 0;  ///< first frame of the receiving hand's hold
  Side to = Side::kLeft;
  GraspTransfer transfer;
  Eigen::Isometry3d giver_from_receiver = Eigen::Isometry3d::Identity();  ///< wrists, both holding
  WristChange giver = {}, receiver = {};  ///< in the result of CarryObject, while both hold
};

/// World pose of a hand's wrist for a body pose.
Eigen::Isometry3d WristIn(const HandModel& hand, const JointPose& pose,
                          const Eigen::Vector3d& trans);

/// Right and left hand as receivers; null: not created yet.
using ReceivingHands = std::array<std::shared_ptr<const GraspReceiver>, 2>;

/// Returns grasps for a hand that takes the object from the other one (TransferGrasp): its fingers
/// close on the object in place, and its wrist moves there as needed. Each result is added to
/// `handovers`, if given. `receivers` (right, left) are created on demand or may be passed if they
/// exist; so may the clip's first transfers (`made`). All other arguments must outlive the result.
GraspMaker GraspsByTransfer(const HandModel& right, const HandModel& left,
                            const TriangleMesh& object, const SignedDistance& surface,
                            const DistanceGrid& distance, const GraspTransferOptions& options,
                            std::vector<Handover>* handovers, ReceivingHands receivers = {},
                            std::vector<GraspTransfer> made = {});

/// A hand as balls (x, y, z, radius; 4 x n, meters, wrist frame): those of its fingers, then 16 in
/// the palm. Their number and order are the same for all finger poses.
Eigen::Matrix4Xd HandBalls(const HandAnatomy& anatomy, const FingerPose& fingers);

/// Balls with transformed centers.
Eigen::Matrix4Xd MovedBalls(const Eigen::Isometry3d& by, Eigen::Matrix4Xd balls);

}  // namespace holdfast
