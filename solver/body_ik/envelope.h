// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

namespace holdfast {

/// A smooth curve that is nowhere below `values`: the largest of those within `radius`, averaged by
/// a bell of the same width. It begins 2 `radius` before what it covers.
std::vector<double> Envelope(const std::vector<double>& values, int radius);

}  // namespace holdfast
