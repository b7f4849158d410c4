// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace holdfast {

/// Draws that are the same on every standard library (its distributions are not).
class RandomDraws {
 public:
  explicit RandomDraws(std::uint64_t seed) : engine_(seed) {}

  double Uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  int Index(int count) { return static_cast<int>(Uniform(0.0, 1.0) * static_cast<double>(count)); }
  /// Standard normal (Box and Muller).
  double Normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform(0.0, 1.0)));
    return radius * std::cos(2.0 * M_PI * Uniform(0.0, 1.0));
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace holdfast
