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
#include "geometry/io/mesh/load_object.h"
#include "geometry/options.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_both.h"
#include "solver/grasp/grasp_set.h"

namespace holdfast {

/// A grasp, and one frame of who holds the object with it.
struct StandingGrasp {
  Grasp grasp;
  GraspReport report;
  Clip clip;  ///< without frames unless `report.status` is kFound
};

/// Closes a hand of the mean shape around the object, and puts it to a standing person whose
/// forearm is turned so that the object is as upright as can be and held far enough out to clear
/// the body, feet at z = 0; a hand alone stays by itself, the wrist 1 m up. `options.up_in_wrist`
/// is filled in with the ways that a forearm can turn. Throws Error as CloseHand does.
StandingGrasp GraspStanding(const std::shared_ptr<const BodyModel>& body, Side side,
                            const LoadedObject& object, GraspOptions options = {},
                            const GraspProgress& progress = {});

/// Many grasps, and who holds the object with them.
struct StandingGraspSet {
  GraspSet set;
  Clip clip;  ///< a frame for each of the first `kMaxShown` grasps; none where there is none
};
inline constexpr int kMaxShown = 100;

/// The same for many distinct grasps (FindGrasps), which the object's uprightness does not rank.
/// Throws Error as FindGrasps does.
StandingGraspSet GraspsStanding(const std::shared_ptr<const BodyModel>& body, Side side,
                                const LoadedObject& object, const GraspSetOptions& options,
                                const GraspProgress& progress = {});

/// One frame of a person of the mean shape who stands with both forearms forward, feet at z = 0:
/// where HoldInBothHands may start from.
Clip StandWithForearmsForward(const std::shared_ptr<const BodyModel>& body);

/// Gives a clip of one frame an object of this name there (meters), held by these hands.
void PutInHands(std::uint8_t hands, const std::string& name,
                const Eigen::Isometry3d& world_from_object, Clip& clip);

enum class GraspHands { kAuto, kRight, kLeft, kBoth };

/// A grasp as the command line or Python asks for it.
struct GraspJob {
  GraspHands hands = GraspHands::kAuto;
  double object_scale = 1.0;
  GraspOptions search;
  GraspSetOptions many;  ///< of many grasps: how far they are apart; all else is `search`
};

/// The options of `grasp`; those of many grasps are "apart_cm" and "apart_angle_deg".
OptionTable OptionsOf(GraspJob& job);

/// The hand that is to hold: for kAuto the only one of a hand alone, else the right. Throws Error
/// for a hand that the body lacks.
Side HandFor(GraspHands hands, const BodyModel& body);

/// FitFailure where no grasp was found, with the object's measures and what to try.
void RequireFound(const GraspReport& report, const LoadedObject& object,
                  const GraspOptions& options);
void RequireFound(const GraspSet& set, const LoadedObject& object);

/// Puts the object between both hands of a person, from `clip`'s one frame on (HoldInBothHands),
/// which it changes. Throws FitFailure where it cannot.
BothHandsGrasp HoldStanding(const ClipBody& person, const LoadedObject& object,
                            const std::optional<GraspPlace::Wanted>& place,
                            BothHandsOptions options, Clip& clip);

/// Measures of a grasp, units in the names.
nlohmann::json GraspJson(const Grasp& grasp);
/// What the hand touches, of a grasp that is returned: "contact" of the summary.
nlohmann::json GraspContactJson(const Grasp& grasp);
/// How many places, placements and hands were tried, and how long that took.
nlohmann::json GraspSearchJson(const GraspReport& report);

}  // namespace holdfast
