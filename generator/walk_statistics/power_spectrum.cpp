// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/power_spectrum.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

namespace holdfast {

double PowerSpectrum::Power(double low_hz, double high_hz) const {
  // Trapezoids between the grid's frequencies, cut at both ends.
  double power = 0.0;
  for (Eigen::Index i = 0; i + 1 < density.size(); ++i) {
    const double begin = std::max(low_hz, FrequencyAt(i));
    const double end = std::min(high_hz, FrequencyAt(i + 1));
    if (end <= begin) continue;
    const double middle = (0.5 * (begin + end) - FrequencyAt(i)) / kStep_Hz;
    power += (end - begin) * ((1.0 - middle) * density[i] + middle * density[i + 1]);
  }
  return power;
}

PowerSpectrum EstimatePower(const Eigen::Ref<const Eigen::MatrixXd>& signals, double rate_hz,
                            std::span<const double> weights) {
  PowerSpectrum spectrum;
  spectrum.rate_hz = rate_hz;
  const Eigen::Index samples = signals.cols();
  if (samples < PowerSpectrum::kShortest) return spectrum;
  const Eigen::Index window = std::min<Eigen::Index>(samples, PowerSpectrum::kWindow);
  const auto frequencies =
      static_cast<Eigen::Index>(std::floor(0.5 * rate_hz / PowerSpectrum::kStep_Hz)) + 1;

  // Transform at any frequency, not only those that fit the window: windows of all lengths then
  // share one grid.
  Eigen::MatrixXd cosines(window, frequencies), sines(window, frequencies);
  double window_power = 0.0;
  for (Eigen::Index t = 0; t < window; ++t) {
    const double hann =
        0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (static_cast<double>(t) + 0.5) /
                             static_cast<double>(window));
    window_power += hann * hann;
    for (Eigen::Index k = 0; k < frequencies; ++k) {
      const double angle =
          2.0 * std::numbers::pi * spectrum.FrequencyAt(k) * static_cast<double>(t) / rate_hz;
      cosines(t, k) = hann * std::cos(angle);
      sines(t, k) = hann * std::sin(angle);
    }
  }

  std::vector<Eigen::Index> begins;
  for (Eigen::Index begin = 0; begin + window <= samples; begin += std::max(window / 2, {1})) {
    begins.push_back(begin);
  }
  if (begins.back() + window < samples) begins.push_back(samples - window);
  const auto weight_of = [&](Eigen::Index begin) {
    if (weights.empty()) return 1.0;
    const auto at = weights.begin() + begin;
    return std::accumulate(at, at + window, 0.0) / static_cast<double>(window);
  };
  const bool any = std::ranges::any_of(begins, [&](auto b) { return weight_of(b) >= 0.5; });

  spectrum.density.setZero(frequencies);
  double total = 0.0;
  for (const Eigen::Index begin : begins) {
    const double weight = any ? weight_of(begin) : 1.0;
    if (weight < 0.5) continue;
    const auto piece = signals.middleCols(begin, window);
    const Eigen::MatrixXd real = piece * cosines, imaginary = piece * sines;
    spectrum.density +=
        weight * (real.colwise().squaredNorm() + imaginary.colwise().squaredNorm()).transpose();
    total += weight;
  }
  // One-sided: what lies below zero is added to what lies above.
  spectrum.density *= 2.0 / (total * window_power * rate_hz);
  return spectrum;
}

}  // namespace holdfast
