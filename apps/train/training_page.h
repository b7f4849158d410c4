// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace holdfast::apps {

/// A page of curves, complete in itself: goals reached, distance left, skating, and the losses, by
/// iteration. `lines` are those of training.jsonl.
std::string TrainingPage(const std::vector<nlohmann::json>& lines, long iterations);

}  // namespace holdfast::apps
