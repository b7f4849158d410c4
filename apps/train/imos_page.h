// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace holdfast::apps {

/// A page of curves, complete in itself: errors of free rollouts on subjects not trained on, and
/// the losses, by iteration. `lines` are those of training.jsonl.
std::string ImosTrainingPage(const std::vector<nlohmann::json>& lines, long iterations);

}  // namespace holdfast::apps
