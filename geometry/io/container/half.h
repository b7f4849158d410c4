// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace holdfast {

/// IEEE 754 half precision to single, exact.
float HalfToFloat(std::uint16_t half);

/// Single to half, to nearest even; infinity beyond 65504.
std::uint16_t FloatToHalf(float value);

}  // namespace holdfast
