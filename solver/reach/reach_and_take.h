// SPDX-License-Identifier: MIT
#pragma once

#include "generator/wandr/network.h"
#include "geometry/progress.h"
#include "solver/fit/prepared_object.h"
#include "solver/reach/reach_options.h"
#include "solver/reach/reach_person.h"
#include "solver/take/take.h"

namespace holdfast {

/// The person walks to the object on its table, takes it and carries it to the other places:
/// TakeFromTable with motions of MakeReachMotions, which keep out of the table where latents are
/// optimised. Side, seed and threads are the request's.
TakeReport ReachAndTake(const ReachPerson& person, const wandr::NetworkWeights& network,
                        const TakeRequest& request, const PreparedObject& object,
                        ReachOptions options = {}, const StagedProgress& progress = {});

/// FitFailure where `object` was not taken, with what to try.
void RequireTaken(const TakeReport& report, const std::string& object);

}  // namespace holdfast
