// SPDX-License-Identifier: MIT
#include "geometry/io/container/half.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace holdfast {

std::uint16_t FloatToHalf(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>((bits >> 16) & 0x8000u);
  const float magnitude = std::fabs(value);
  if (std::isnan(value)) return static_cast<std::uint16_t>(sign | 0x7e00u);
  if (magnitude >= 65520.0f) return static_cast<std::uint16_t>(sign | 0x7c00u);
  // Scaled so that one unit is the last place of the half: nearbyint then rounds to nearest even.
  const int exponent = std::max(magnitude > 0.0f ? std::ilogb(magnitude) : -14, -14);
  const auto units = static_cast<std::uint32_t>(
      std::lrint(std::ldexp(static_cast<double>(magnitude), 10 - exponent)));
  return static_cast<std::uint16_t>(
      sign + static_cast<std::uint16_t>(units + (static_cast<std::uint32_t>(exponent + 14) << 10)));
}

}  // namespace holdfast
