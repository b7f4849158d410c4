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

/// The summary for people (lines of text) and for machines.
std::string SummaryText(const FitSummary& summary, const ContactProtocol& protocol);
nlohmann::json SummaryJson(const FitSummary& summary);

/// Every term and metric of every frame, units in the names.
nlohmann::json PerFrameJson(const FitResult& result, const ContactScore& contact);

/// How the numbers were measured, so that they can be compared.
nlohmann::json ProtocolJson(const ContactProtocol& protocol, const Solid& object,
                            const HandModel& hand);

}  // namespace holdfast::apps
