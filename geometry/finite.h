// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace holdfast {

/// Place of the first value that is infinite or no number; nothing when all are finite. Runs at the
/// speed of memory.
std::optional<std::size_t> FirstNonFinite(std::span<const float> values);
std::optional<std::size_t> FirstNonFinite(std::span<const double> values);

}  // namespace holdfast
