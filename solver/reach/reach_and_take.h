// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include "generator/wandr/network.h"
#include "geometry/parallel.h"
#include "solver/fit/prepared_object.h"
#include "solver/reach/reach_options.h"
#include "solver/reach/walk_and_reach.h"
#include "solver/take/take.h"

namespace holdfast {

/// The person walks to the object on its table, takes it and carries it to the other places:
/// TakeFromTable with motions of MakeReachMotions, which avoid the table if latents are optimized.
/// Side, seed and threads are those of the request.
TakeReport ReachAndTake(const ReachPerson& person, const wandr::NetworkWeights& network,
                        const TakeRequest& request, const PreparedObject& object,
                        ReachOptions options = {}, const StagedProgress& progress = {});

/// Throws FitFailure if `object` was not taken, with a suggestion.
void RequireTaken(const TakeReport& report, const std::string& object);

/// Outcome of each goal in a motion, as a list; null for frames that never came. `why`:
/// ReachReport::why_missed.
nlohmann::json GoalsJson(const wandr::ReachSample& sample, std::span<const Eigen::Vector3d> goals,
                         const std::vector<std::optional<std::string>>& why);

/// Quality of a motion as in metrics.json; units in the names.
nlohmann::json MotionJson(const ReachMotion& motion);

/// A take as in metrics.json: "take" (person, method, times, table), "summary" (measures, units in
/// the names), "notes", "per_frame". Requires status kTaken.
nlohmann::json TakeJson(const TakeReport& report);

}  // namespace holdfast
