// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

namespace holdfast {

/// Welch's estimate of how the power of signals is spread over frequency: Hann windows of
/// `window` samples that overlap by half, the last one at the end; a signal shorter than that is
/// one window of its own length.
struct PowerSpectrum {
  static constexpr double kStep_Hz = 0.25;
  static constexpr int kWindow = 64;    ///< samples: 2.1 s at 30 Hz
  static constexpr int kShortest = 16;  ///< samples; fewer have no spectrum
  double rate_hz = 0.0;                 ///< of the signals
  Eigen::VectorXd density;              ///< (rate / 2 / kStep + 1) per Hz, at 0, 0.25, .. Hz

  double FrequencyAt(Eigen::Index i) const { return kStep_Hz * static_cast<double>(i); }
  /// The integral over [low, high] Hz: shares of it are shares of the mean square.
  double Power(double low_hz, double high_hz) const;
};

/// `signals` (C x T): one channel per row, of which the densities are added up. `weights` (T), if
/// any: a window counts by their mean over it (windows of mean below a half do not count, unless
/// all are). One-sided: the integral is the mean square of the signals. An empty density for fewer
/// than kShortest samples.
PowerSpectrum EstimatePower(const Eigen::Ref<const Eigen::MatrixXd>& signals, double rate_hz,
                            std::span<const double> weights = {});

}  // namespace holdfast
