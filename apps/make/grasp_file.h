// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include "solver/grasp/grasp.h"

namespace holdfast::apps {

/// Grasps of one hand on one object, to the last bit; `key` says what they are of.
void WriteGrasps(const std::vector<Grasp>& grasps, const nlohmann::json& key,
                 const std::filesystem::path& path);

/// The grasps of a file with the same key; nothing where there is no such file, or another's.
std::optional<std::vector<Grasp>> ReadGrasps(const nlohmann::json& key,
                                             const std::filesystem::path& path);

}  // namespace holdfast::apps
