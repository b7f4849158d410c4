// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <span>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "solver/body_ik/reach_clip.h"

namespace holdfast {

/// Writes a clip with the goals that it reaches, as networks learn them (wandr::ReadCorpus): arrays
/// goal (K x 3, world, metres), goal_frame (K), goal_wrist (K; 1 right, 2 left) and a text
/// provenance. Numbers are rounded to floats. Throws Error for a file that cannot be written.
void WriteGoalClip(Clip clip, std::span<const ReachLabel> labels, const nlohmann::json& provenance,
                   const std::filesystem::path& path);

}  // namespace holdfast
