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

/// The first grasp; units in the names.
nlohmann::json FirstGraspJson(const FirstGrasp& first);

/// Weights of all terms, "lambda_...".
nlohmann::json WeightsJson(const FitOptions& options);
/// Ceres solver of the fit's frames and its stopping criteria.
nlohmann::json SolverJson(const FitOptions& options);
/// Protocol of the contact and penetration measurements, for comparability.
nlohmann::json ProtocolJson(const ContactProtocol& protocol, const Solid& object,
                            const HandModel& hand);

/// Contact and penetration over a clip, units in the names; null if no frame is held.
nlohmann::json ContactJson(const ContactScore& contact);

/// Summary of a fit: ContactJson, number of frames and of failed frames, medians over the solved
/// frames.
nlohmann::json FitSummaryJson(const FitResult& fit, const ContactScore& contact);

/// All terms and metrics of a fit, each a list over the frames; units in the names.
nlohmann::json FitFramesJson(const FitResult& fit, const ContactScore& contact,
                             const ClearanceReport& clearance);

/// Drinking times and measures: frames, millimeters, degrees; null if nobody drinks.
nlohmann::json DrinkJson(const std::optional<DrinkReport>& drink, const DrinkMeasures& drunk);

/// Handovers of a clip, a list as in metrics.json: frames, hands, confidence and the receiving
/// hand's grasp.
nlohmann::json SwitchesJson(const HoldLabels& holding, const std::vector<Handover>& handovers);

/// Avoidance of the body by the arms, and remaining collisions; over the clip, units in the names.
nlohmann::json ClearanceJson(const ClearanceReport& report);

/// Counts of hands and fingertips in the held frames, and of finger jumps.
nlohmann::json HandsJson(const CarriedQuality& quality);

/// Results of the finger repair, a list over the hands.
nlohmann::json FingersJson(const std::vector<FingerRepair>& fingers);

/// Frames that a refinement keeps unchanged: a list.
nlohmann::json KeptJson(const std::vector<FrameRange>& kept);

/// Intervals found by a refinement: {"holds": [...], "rests": [...], "touches": [...]}, with units.
nlohmann::json HoldsJson(const RefineResult& result);

}  // namespace holdfast
