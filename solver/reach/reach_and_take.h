// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include "generator/wandr/network.h"
#include "geometry/parallel.h"
#include "solver/fit/prepared_object.h"
#include "solver/reach/reach_options.h"
#include "solver/reach/reach_person.h"
#include "solver/reach/walk_and_reach.h"
#include "solver/take/take.h"

namespace holdfast {

/// The person walks to the object on its table, takes it and carries it to the other places:
/// TakeFromTable with motions of MakeReachMotions, which keep out of the table where latents are
/// optimized. Side, seed and threads are the request's.
TakeReport ReachAndTake(const ReachPerson& person, const wandr::NetworkWeights& network,
                        const TakeRequest& request, const PreparedObject& object,
                        ReachOptions options = {}, const StagedProgress& progress = {});

/// FitFailure where `object` was not taken, with what to try.
void RequireTaken(const TakeReport& report, const std::string& object);

/// Why the best motion missed each goal, for people; nothing for a goal that it reached or never
/// set out to.
std::vector<std::optional<std::string>> WhyMissed(const ReachReport& report,
                                                  const ReachPerson& person,
                                                  const ReachOptions& options);

/// What became of each goal in a motion: a list; null for frames that never came. `why`: WhyMissed.
nlohmann::json GoalsJson(const wandr::ReachSample& sample, std::span<const Eigen::Vector3d> goals,
                         const std::vector<std::optional<std::string>>& why);

/// How good a motion is, as metrics.json has it; units in the names.
nlohmann::json MotionJson(const ReachMotion& motion);

/// A take as metrics.json has it: "take" (who, how, when, the table), "summary" (its measures,
/// units in the names), "notes", "per_frame". Of a report with status kTaken.
nlohmann::json TakeJson(const TakeReport& report);

}  // namespace holdfast
