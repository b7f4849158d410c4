// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

namespace holdfast {

/// Called now and then, from one thread at a time, with the stage of the work ("grasp", "fit",
/// "metrics") and how much of that is done. Returning false stops the work.
using StagedProgress = std::function<bool(const char* stage, int done, int total)>;

}  // namespace holdfast
