// SPDX-License-Identifier: MIT
#include "solver/fit/fit_options.h"

#include <algorithm>

#include <fmt/format.h>

namespace holdfast {
namespace {

constexpr EnergyTermInfo kTerms[] = {
    {EnergyTerm::kDistance, "distance", &FitOptions::lambda_distance, true, "energy_distance_m2",
     "Weight of E_d: keep the distances between hand and object (IMoS eq. 7)"},
    {EnergyTerm::kContact, "contact", &FitOptions::lambda_contact, true, "energy_contact_m2",
     "Weight of E_c: keep contacts (IMoS eq. 8)"},
    {EnergyTerm::kTemporal, "temporal", &FitOptions::lambda_temporal, true, "energy_temporal",
     "Weight of E_t: keep changes between frames small (IMoS eq. 9)"},
    {EnergyTerm::kSlip, "slip", &FitOptions::lambda_slip, false, "energy_slip_m2",
     "Weight of E_s: keep contacts, but let them slide along the surface"},
    {EnergyTerm::kPenetration, "penetration", &FitOptions::lambda_penetration, false,
     "energy_penetration_m2", "Weight of E_p: keep the hand out of the object"},
    {EnergyTerm::kObjectInHand, "object_in_hand", &FitOptions::lambda_object_in_hand, false,
     "energy_object_in_hand_m2",
     "Weight of E_o: keep the object out of the hand (thin walls, blades)"},
    {EnergyTerm::kLimits, "limits", &FitOptions::lambda_limits, false, nullptr,
     "Weight of finger angles beyond their joint limits, per rad2"},
    {EnergyTerm::kWrist, "wrist", &FitOptions::lambda_wrist, false, nullptr,
     "Weight of E_w: keep the wrists at the clip's positions while both hands hold the object"},
    {EnergyTerm::kFingers, "fingers", &FitOptions::lambda_fingers, false, nullptr,
     "Weight of finger deviation from the clip, per rad2 and frame"},
    {EnergyTerm::kObject, "object", &FitOptions::lambda_object, false, nullptr,
     "Weight of object deviation from the clip's trajectory, per m2 and frame"},
    {EnergyTerm::kAcceleration, "acceleration", &FitOptions::lambda_acceleration, false, nullptr,
     "Weight of E_a: keep accelerations of object and fingers small when all frames are solved "
     "together; higher values remove more jitter"},
    {EnergyTerm::kSupport, "support", &FitOptions::lambda_support, false, nullptr,
     "Weight of keeping a resting object at rest"},
};

}  // namespace

std::span<const EnergyTermInfo> EnergyTerms() { return kTerms; }

Energies& Energies::operator+=(const Energies& more) {
  for (std::size_t k = 0; k < values_.size(); ++k) values_[k] += more.values_[k];
  return *this;
}

double Energies::Total(const FitOptions& options) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < values_.size(); ++k) sum += options.*kTerms[k].weight * values_[k];
  return sum;
}

double FitOptions::ContactWeight(double pairs, double contacts) const {
  return normalize == Normalization::kMean ? lambda_contact * pairs / std::max(contacts, 1.0)
                                           : lambda_contact;
}

double FitOptions::TemporalWeight(double pairs) const {
  constexpr double kCoordinates = 6 + kHandDofs;
  return normalize == Normalization::kMean ? lambda_temporal * pairs / kCoordinates
                                           : lambda_temporal;
}

FitOptions FitOptions::OnlyPaper() const {
  FitOptions options = *this;
  options.slip = false;
  for (const EnergyTermInfo& info : kTerms) {
    if (!info.in_paper) options.*info.weight = 0.0;
  }
  return options;
}

void AddWeightOptions(OptionTable& table, FitOptions& fit,
                      const std::function<bool(const EnergyTermInfo&)>& terms) {
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (terms(info)) {
      table.Number(fmt::format("lambda_{}", info.name), "", fit.*info.weight, kNonNegative,
                   info.help);
    }
  }
}

}  // namespace holdfast
