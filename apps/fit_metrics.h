// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "geometry/body/hand_model.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/exact_intersection.h"
#include "solver/clearance/clearance.h"
#include "solver/fit/fit.h"

namespace holdfast::apps {

/// The weights of all terms, "lambda_...".
nlohmann::json WeightsJson(const FitOptions& options);
/// Which solver of Ceres a fit's frames are solved with, and when it stops.
nlohmann::json SolverJson(const FitOptions& options);

/// The option --lambda-... of a term.
CLI::Option* AddWeightOption(CLI::App& command, EnergyTerm term, FitOptions& options);

/// How far the arms gave way to the body, or what is in it: a line of text; empty where it is clear
/// of itself.
std::string ClearanceText(const ClearanceReport& report);

/// What FitSummaryJson has, in lines of text.
std::string SummaryText(const nlohmann::json& summary, const ContactProtocol& protocol);

/// `count` frames from `begin` on of what a result's `metrics` (its metrics.json) have per frame,
/// as a table: frame (from 0 at `begin`), time_s, and a column for each name there, units in the
/// names. true and false are 1 and 0; what was not measured stays empty. Throws Error about
/// `source` where there is nothing per frame, or not for each of the `frames` of its clip.
std::string PerFrameCsv(const nlohmann::json& metrics, const std::string& source, double frame_rate,
                        int frames, int begin, int count);

/// How the numbers were measured, so that they can be compared.
nlohmann::json ProtocolJson(const ContactProtocol& protocol, const Solid& object,
                            const HandModel& hand);

}  // namespace holdfast::apps
