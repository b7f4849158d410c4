// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "geometry/body/body_model.h"
#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/fit/fit.h"
#include "solver/grasp/grasp_place.h"

namespace holdfast::apps {

/// Throws at once for what no hand can hold: Error for an object that is no size for a hand
/// (RequireHandheld), FitFailure for a large one that nowhere is within the span of a hand, or of
/// `both`.
void RequireGraspable(const LoadedObject& object, bool both);

/// Closes a hand around the object in the clip's first frame and writes fingers and object into it.
/// `style` as in StyleByName, or "auto"; `place` may be null. The object keeps clear of the body
/// along the clip; told is what meets it in the first `held_frames`, while this hand alone holds
/// it. `summary` says what was found. Returns false when there is nothing to hold on to; warns when
/// the grasp is not clean.
bool GraspInFirstFrame(const HandModel& hand, const LoadedObject& object,
                       const SignedDistance& surface, const DistanceGrid& grid,
                       const BodySurface& body, int held_frames, const std::string& style,
                       const std::shared_ptr<const GraspPlace>& place, const CommonOptions& common,
                       Clip& clip, nlohmann::json& summary);

/// The same with the object between both hands. The arms have to go to it: returns how each hand
/// (right, left) takes hold, relative to the clip's wrists, which stay; nothing when there is no
/// way.
std::optional<std::array<GripPose, 2>> HoldInFirstFrame(
    const HandModel& right, const HandModel& left, const LoadedObject& object,
    const DistanceGrid& grid, const BodySurface& body, const CommonOptions& common, Clip& clip,
    nlohmann::json& summary);

}  // namespace holdfast::apps
