// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"

namespace holdfast::apps {

void AddTrainRecogniserCommand(CLI::App& app, int& exit_code);

}  // namespace holdfast::apps
