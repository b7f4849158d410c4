// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/object/load_object.h"
#include "geometry/options.h"
#include "solver/carry/first_grasp.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_both.h"
#include "solver/grasp/grasp_set.h"

namespace holdfast {

/// A grasp, and a one-frame clip of a person or hand holding the object with it.
struct StandingGrasp {
  Grasp grasp;
  GraspReport report;
  Clip clip;  ///< empty unless `report.status` is kFound
};

/// Closes a hand of the mean shape around the object and attaches it to a standing person, feet at
/// z = 0, with the forearm rotated for the most upright object and the arm far enough out for the
/// object to clear the body. A lone hand has no person; its wrist is 1 m up. `options.up_in_wrist`
/// is set from the possible forearm rotations. Throws Error as CloseHand does.
StandingGrasp GraspStanding(const std::shared_ptr<const BodyModel>& body, Side side,
                            const LoadedObject& object, GraspOptions options = {},
                            const GraspProgress& progress = {});

/// Many grasps, and a clip of a person or hand holding the object with them.
struct StandingGraspSet {
  GraspSet set;
  Clip clip;  ///< one frame for each of the first `kMaxShown` grasps; may be empty
};
inline constexpr int kMaxShown = 100;

/// The same for many distinct grasps (FindGrasps), whose ranking ignores the object's uprightness.
/// Throws Error as FindGrasps does.
StandingGraspSet GraspsStanding(const std::shared_ptr<const BodyModel>& body, Side side,
                                const LoadedObject& object, const GraspSetOptions& options,
                                const GraspProgress& progress = {});

/// One frame of a standing person with both forearms forward, feet at z = 0: a start for
/// HoldInBothHands.
Clip StandWithForearmsForward(const ClipBody& person);

/// A grasp as requested by the command line or Python.
struct GraspJob {
  GraspHands hands = GraspHands::kAuto;
  double object_scale = 1.0;
  GraspOptions search;
  GraspSetOptions many;  ///< for many grasps: how distinct they are; all else is in `search`
};

/// Options of `grasp`; those for many grasps are "apart_cm" and "apart_angle_deg".
OptionTable OptionsOf(GraspJob& job);

/// The hand that is to hold: for kAuto the only hand of a lone-hand model, else the right. Throws
/// Error for a hand that the body lacks.
Side HandFor(GraspHands hands, const BodyModel& body);

/// Throws FitFailure if no grasp was found, with the object's dimensions and suggestions.
void RequireFound(const GraspReport& report, const LoadedObject& object,
                  const GraspOptions& options);
void RequireFound(const GraspSet& set, const LoadedObject& object);

/// Puts the object between both hands of a person, starting from the only frame of `clip`, which it
/// modifies (HoldInBothHands). Throws FitFailure on failure.
BothHandsGrasp HoldStanding(const ClipBody& person, const LoadedObject& object,
                            const std::optional<GraspPlace::Wanted>& place,
                            BothHandsOptions options, Clip& clip);

/// Measures of a grasp, units in the names.
nlohmann::json GraspJson(const Grasp& grasp);
/// Contacts of a returned grasp: "contact" of the summary.
nlohmann::json GraspContactJson(const Grasp& grasp);
/// Numbers of places, placements and hands tried, and the time taken.
nlohmann::json GraspSearchJson(const GraspReport& report);

}  // namespace holdfast
