// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

namespace holdfast {

/// Smooth over time and not below the mean of `values` anywhere: the largest of `radius` values on
/// either side, weighted by a bell of the same width.
std::vector<double> Envelope(const std::vector<double>& values, int radius);

}  // namespace holdfast
