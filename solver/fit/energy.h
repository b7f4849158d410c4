// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>

#include "geometry/options.h"
#include "solver/fit/fit_options.h"

namespace holdfast {

/// Terms of the fit's energy. Those up to kObjectInHand are reported frame by frame.
enum class EnergyTerm {
  kDistance,
  kContact,
  kTemporal,
  kSlip,
  kPenetration,
  kObjectInHand,
  kLimits,
  kWrist,
  kFingers,
  kObject,
  kAcceleration,
  kSupport,
};
inline constexpr int kNumReportedEnergies = static_cast<int>(EnergyTerm::kObjectInHand) + 1;

/// What is known of a term: all that weights, reports and command lines need.
struct EnergyTermInfo {
  EnergyTerm term;
  const char* name;            ///< "object_in_hand"
  double FitOptions::*weight;  ///< 0: the term is off
  bool in_paper;               ///< IMoS, eq. 7 to 9
  const char* metric;          ///< its column of metrics.json, by frame, with unit; null: none
  const char* help;            ///< of its weight
};

/// All terms, in the order of EnergyTerm.
std::span<const EnergyTermInfo> EnergyTerms();
/// Options of the weights by their names ("lambda_contact"), of the terms that `wanted` takes.
void AddWeightOptions(OptionTable& table, FitOptions& options,
                      const std::function<bool(const EnergyTermInfo&)>& wanted);

/// Energies of one frame without weights, all hands together.
class Energies {
 public:
  double& operator[](EnergyTerm term) { return values_.at(static_cast<std::size_t>(term)); }
  double operator[](EnergyTerm term) const { return values_.at(static_cast<std::size_t>(term)); }
  Energies& operator+=(const Energies& more);
  /// The weighted sum.
  double Total(const FitOptions& options) const;

 private:
  std::array<double, kNumReportedEnergies> values_{};
};

}  // namespace holdfast
