// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "geometry/seed.h"

namespace holdfast::nn {

/// Counter-based random numbers: the k-th is a mix of seed and k (SplitMix64; Steele, Lea & Flood
/// 2014). One stream per rollout makes the numbers independent of the order of rollouts.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed) : state_(seed) {}
  /// Streams with the same seed and different indices are independent.
  RandomStream(std::uint64_t seed, std::uint64_t index)
      : state_(SplitMix64(SplitMix64(seed) ^ SplitMix64(~index))) {}

  std::uint64_t Next() { return SplitMix64(state_ += kSplitMixStep); }
  /// Uniform in [0, 1) with 53 bits.
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }
  /// Draws two samples of N(0, 1) (Box & Muller 1958).
  void NormalPair(double& first, double& second) {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
    const double angle = 2.0 * std::numbers::pi * Uniform();
    first = radius * std::cos(angle);
    second = radius * std::sin(angle);
  }
  /// Draws a sample of N(0, 1), alternately the first and the second of a pair.
  double Normal() {
    has_second_ = !has_second_;
    if (!has_second_) return second_;
    double first;
    NormalPair(first, second_);
    return first;
  }

 private:
  std::uint64_t state_;
  double second_ = 0.0;  // of the last pair, if Normal has not returned it yet
  bool has_second_ = false;
};

}  // namespace holdfast::nn

namespace holdfast {

/// Random draws that are identical on every standard library (std distributions are not).
class RandomDraws {
 public:
  explicit RandomDraws(std::uint64_t seed) : engine_(seed) {}

  double Uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  int Index(int count) { return static_cast<int>(Uniform(0.0, 1.0) * static_cast<double>(count)); }
  /// Draws a sample of N(0, 1) (Box & Muller).
  double Normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform(0.0, 1.0)));
    return radius * std::cos(2.0 * M_PI * Uniform(0.0, 1.0));
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace holdfast
