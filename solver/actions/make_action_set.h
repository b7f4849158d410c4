// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "generator/actions/standing_start.h"
#include "geometry/body/body_model.h"
#include "geometry/parallel.h"
#include "solver/actions/action_plan.h"

namespace holdfast {

struct ActionSetReport {
  bool complete = false;  ///< false: stopped by `progress`
  nlohmann::json head;    ///< of the manifest: what was asked and its "summary"
  int had = 0;            ///< clips of it that were tried before
  int made = 0;           ///< tried now
  double seconds = 0.0;   ///< for these, of all threads together
};

/// Makes a labeled set of people who do things with objects in `folder`: s1/mug_drink_1.npz ...,
/// manifest.json (schema holdfast/actions/1), and grasps/ with the grasps that a later run need not
/// look for again. A set that was stopped is resumed, a finished one extended. A clip with a
/// fault is tried anew from another start, and given up in the end: see MakeActionClip. Progress
/// (stage "clips") comes as subjects' clips with one object are done. Throws Error as PlanActions
/// does, for a manifest of something else, and a folder that cannot be written.
ActionSetReport MakeActionSet(const std::shared_ptr<const BodyModel>& body,
                              const ActionStarts& starts, const std::filesystem::path& folder,
                              const ActionSetOptions& options, const StagedProgress& progress = {});

}  // namespace holdfast
