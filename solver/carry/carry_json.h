// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/body/hand_model.h"
#include "geometry/score/contact_score.h"
#include "geometry/score/exact_intersection.h"
#include "solver/carry/carry.h"
#include "solver/carry/first_grasp.h"
#include "solver/carry/refine.h"
#include "solver/clearance/clearance.h"
#include "solver/fit/fit.h"

namespace holdfast {

/// How the object came into the hand, units in the names.
nlohmann::json FirstGraspJson(const FirstGrasp& first);

/// The weights of all terms, "lambda_...".
nlohmann::json WeightsJson(const FitOptions& options);
/// Which solver of Ceres a fit's frames are solved with, and when it stops.
nlohmann::json SolverJson(const FitOptions& options);
/// How contact and penetration were measured, so that they can be compared.
nlohmann::json ProtocolJson(const ContactProtocol& protocol, const Solid& object,
                            const HandModel& hand);

/// Contact and penetration over a clip, units in the names; null where no frame is held.
nlohmann::json ContactJson(const ContactScore& contact);

/// A fit in a few numbers: ContactJson, frames, those that failed, medians over the frames that
/// were solved.
nlohmann::json FitSummaryJson(const FitResult& fit, const ContactScore& contact);

/// Every term and metric of a fit: a list over the frames for each, units in the names.
nlohmann::json FitFramesJson(const FitResult& fit, const ContactScore& contact,
                             const ClearanceReport& clearance);

/// How somebody drinks, and what came of it: frames, millimeters, degrees; null for nobody.
nlohmann::json DrinkJson(const std::optional<DrinkReport>& drink, const DrinkMeasures& drunk);

/// The hand-overs of a carried clip, a list as in metrics.json: frames, hands, confidence and the
/// receiving hand's grasp.
nlohmann::json SwitchesJson(const HoldLabels& holding, const std::vector<Handover>& handovers);

/// How the arms avoided the body, and what remains: numbers over the clip, units in the names.
nlohmann::json ClearanceJson(const ClearanceReport& report);

/// Of hands and fingertips in the frames in which hands hold, and of fingers that jump: counts.
nlohmann::json HandsJson(const CarriedQuality& quality);

/// What became of fingers, a list over the hands.
nlohmann::json FingersJson(const std::vector<FingerRepair>& fingers);

/// Frames of a refinement that stay as the clip has them: a list.
nlohmann::json KeptJson(const std::vector<FrameRange>& kept);

/// What a refinement found: {"holds": [...], "rests": [...], "touches": [...]}, units in the names.
nlohmann::json HoldsJson(const RefineResult& result);

}  // namespace holdfast
