// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/fit/fit.h"
#include "solver/handover/grasp_transfer.h"

namespace holdfast {

/// A grasp that was handed over.
struct Handover {
  int frame = 0;  ///< in which the receiving hand takes hold
  Side to = Side::kLeft;
  GraspTransfer transfer;
};

/// Grasps for a hand that takes the object over from the other one (TransferGrasp): its fingers
/// close on the object as it is, and its wrist goes where that needs it. What came of each is added
/// to `handovers`, if given. All arguments must outlive what is returned.
GraspMaker GraspsByTransfer(const HandModel& right, const HandModel& left,
                            const TriangleMesh& object, const SignedDistance& surface,
                            const DistanceGrid& distance, const GraspTransferOptions& options,
                            std::vector<Handover>* handovers);

}  // namespace holdfast
