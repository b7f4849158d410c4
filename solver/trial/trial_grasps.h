// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "solver/grasp/grasp_set.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// Tries many grasps of one object (FindGrasps) in the six directions each, on `protocol.threads`
/// threads. `progress` is called with the completed fraction, in (0, 1], from one thread at a time;
/// once it returns false, trials not yet begun stay empty: held in none. Throws Error without
/// MuJoCo, and for an object without volume.
std::vector<HoldTrial> TryGrasps(const HandModel& hand, const TriangleMesh& object,
                                 std::span<const CertifiedGrasp> grasps,
                                 const TrialProtocol& protocol = {},
                                 const std::function<bool(double)>& progress = {});

}  // namespace holdfast
