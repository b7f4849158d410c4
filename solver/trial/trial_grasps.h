// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "solver/grasp/grasp_set.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// Tries many grasps of one object (FindGrasps), each in the six directions, `protocol.threads` at
/// a time. `progress` is called with the share of those done, in (0, 1], from one thread at a time;
/// once it returns false, what was not begun stays empty: held in none. Throws Error without
/// MuJoCo, and for an object without volume.
std::vector<HoldTrial> TryGrasps(const HandModel& hand, const TriangleMesh& object,
                                 std::span<const CertifiedGrasp> grasps,
                                 const TrialProtocol& protocol = {},
                                 const std::function<bool(double)>& progress = {});

}  // namespace holdfast
