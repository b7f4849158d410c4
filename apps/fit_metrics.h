// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/contact_metrics.h"
#include "geometry/hand_model.h"
#include "geometry/mesh.h"
#include "geometry/signed_distance.h"
#include "solver/fit.h"

namespace holdfast::apps {

/// A fit in a few numbers; medians over the frames that were solved.
struct FitSummary {
  int frames = 0;
  int contact_pairs = 0;
  int failed = 0;  ///< frames that hold the rigid start
  int at_iteration_limit = 0;
  double solve_ms = 0.0;
  double iterations = 0.0;
  ContactSummary contact;
};

/// One account of every frame, over the hands that hold in it (all hands where none does): the
/// deepest, the sum of volumes, and contact only where each of them touches. `per_hand[h]` is that
/// of `hands[h]`, `holding` has bits as in Clip::holding_hand.
std::vector<ContactMetrics> OfHoldingHands(const std::vector<std::vector<ContactMetrics>>& per_hand,
                                           const std::vector<const HandModel*>& hands,
                                           const std::vector<std::uint8_t>& holding);

FitSummary SummarizeFit(const FitResult& result, const std::vector<ContactMetrics>& contact);

/// The summary for people (lines of text) and for machines.
std::string SummaryText(const FitSummary& summary, const ContactProtocol& protocol);
nlohmann::json SummaryJson(const FitSummary& summary);

/// Every term and metric of every frame, units in the names.
nlohmann::json PerFrameJson(const FitResult& result, const std::vector<ContactMetrics>& contact);

/// How the numbers were measured, so that they can be compared.
nlohmann::json ProtocolJson(const ContactProtocol& protocol, const TriangleMesh& object,
                            const SignedDistance& surface, const HandModel& hand);

}  // namespace holdfast::apps
