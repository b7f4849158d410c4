// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/robot/robot_solids.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// Which of the poses that the starts led to is taken: of those that cost at most half more than
/// the least, the cheapest whose touching links hold the object's weight in every direction by
/// little friction (`HoldsGravity`); the cheapest of all where none does. Returns its index.
/// `object` is the distance of `mesh`.
int ChooseStart(const RobotHand& hand, const RobotSolids& solids, const SignedDistance& object,
                const TriangleMesh& mesh, const std::vector<RobotPose>& poses,
                const std::vector<double>& costs);

}  // namespace holdfast
