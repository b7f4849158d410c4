// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "geometry/body/hand_model.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/contact_score.h"
#include "solver/carry/first_grasp.h"
#include "solver/clearance/clearance.h"
#include "solver/fit/fit.h"

namespace holdfast::apps {

/// A fit in a few numbers; medians over the frames that were solved.
struct FitSummary {
  int frames = 0;
  int contact_pairs = 0;
  int failed = 0;  ///< frames that hold the rigid start
  int at_iteration_limit = 0;
  double solve_ms = 0.0;
  double iterations = 0.0;
  ContactScore contact;
};

/// The weights of all terms, "lambda_...".
nlohmann::json WeightsJson(const FitOptions& options);

/// The option --lambda-... of a term.
CLI::Option* AddWeightOption(CLI::App& command, EnergyTerm term, FitOptions& options);

/// How the object came into the hand, as metrics.json has it.
nlohmann::json FirstGraspJson(const FirstGrasp& first);

FitSummary SummarizeFit(const FitResult& result, ContactScore contact);

/// How far the arms gave way to the body, or what is in it: a line of text; empty where it is clear
/// of itself.
std::string ClearanceText(const ClearanceReport& report);

/// The summary for people (lines of text) and for machines.
std::string SummaryText(const FitSummary& summary, const ContactProtocol& protocol);
nlohmann::json SummaryJson(const FitSummary& summary);

/// Every term and metric of every frame, units in the names.
nlohmann::json PerFrameJson(const FitResult& result, const ContactScore& contact,
                            const ClearanceReport& clearance);

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
