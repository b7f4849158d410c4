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
#include "solver/hand/hand_postures.h"
#include "solver/handover/grasp_transfer.h"

namespace holdfast {

/// How far a wrist is from where the clip had it, at most.
struct WristChange {
  double moved_m = 0.0, turned_rad = 0.0;
};

/// A grasp that was handed over.
struct Handover {
  int frame = 0;  ///< in which the receiving hand takes hold
  Side to = Side::kLeft;
  GraspTransfer transfer;
  Eigen::Isometry3d giver_from_receiver = Eigen::Isometry3d::Identity();  ///< wrists, both holding
  WristChange giver = {}, receiver = {};  ///< in the result of CarryObject, while both hold
};

/// World pose of a hand's wrist in a body's pose.
Eigen::Isometry3d WristIn(const HandModel& hand, const JointPose& pose,
                          const Eigen::Vector3d& trans);

/// The right and the left hand as receivers; null: not asked for yet.
using ReceivingHands = std::array<std::shared_ptr<const GraspReceiver>, 2>;

/// Grasps for a hand that takes the object over from the other one (TransferGrasp): its fingers
/// close on the object as it is, and its wrist goes where that needs it. What came of each is added
/// to `handovers`, if given. `receivers` (right, left) are made when they are first asked for, or
/// may be given where they are there already; so may the clip's first transfers (`made`). All other
/// arguments must outlive what is returned.
GraspMaker GraspsByTransfer(const HandModel& right, const HandModel& left,
                            const TriangleMesh& object, const SignedDistance& surface,
                            const DistanceGrid& distance, const GraspTransferOptions& options,
                            std::vector<Handover>* handovers, ReceivingHands receivers = {},
                            std::vector<GraspTransfer> made = {});

/// A hand as balls (x, y, z, radius; 4 x n, meters, wrist's frame): those of its fingers, then 16
/// in the palm. The same number, in the same order, for any fingers.
Eigen::Matrix4Xd HandBalls(const HandAnatomy& anatomy, const FingerPose& fingers);

/// Balls with their centers moved.
Eigen::Matrix4Xd MovedBalls(const Eigen::Isometry3d& by, Eigen::Matrix4Xd balls);

}  // namespace holdfast
