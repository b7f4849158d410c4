// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"

namespace holdfast::apps {

/// Adds `evaluate transfer`: clips on robots' hands, beside published ways to get there.
void AddEvaluateTransfer(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
