// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstdint>

namespace holdfast {

/// IEEE 754 half precision to single, exact. Without branches: body models have millions.
inline float HalfToFloat(std::uint16_t half) {
  constexpr std::uint32_t kRebias = 112u << 23;
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
  const std::uint32_t magnitude = static_cast<std::uint32_t>(half & 0x7fffu) << 13;
  const std::uint32_t normal = magnitude + kRebias;
  const std::uint32_t infinite = normal + kRebias;  // or no number
  const auto subnormal =
      std::bit_cast<std::uint32_t>(std::bit_cast<float>(normal + (1u << 23)) - 0x1p-14f);
  const std::uint32_t finite = magnitude < (1u << 23) ? subnormal : normal;
  return std::bit_cast<float>(sign | (magnitude < (31u << 23) ? finite : infinite));
}

/// Single to half, to nearest even; infinity beyond 65504.
std::uint16_t FloatToHalf(float value);

}  // namespace holdfast
