// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/make/capture_set.h"
#include "generator/matching/capture_quality.h"

namespace holdfast::apps {

// manifest.json of made reaches: a head (what was asked, which captures, in the end a summary and
// statistics side by side), and `clips`: one line for each that was tried, by index.

nlohmann::json QualityJson(const MotionQuality& quality);
nlohmann::json StatisticsJson(const MotionStatistics& statistics);
/// Every capture with its split, quality, and why it was dropped.
nlohmann::json CapturesJson(const std::vector<Capture>& captures);

/// The whole manifest, one clip a line.
std::string ManifestText(const nlohmann::json& head, const std::vector<nlohmann::json>& lines);

/// The clips of an earlier run that asked for the same (hours may differ); none when there was
/// none, or with `force` another one. Throws Error for a manifest of something else.
std::vector<nlohmann::json> LinesBefore(const std::filesystem::path& manifest,
                                        const nlohmann::json& head, bool force);

/// Of one line: what it adds to the motion made; zero when the clip was dropped.
double MinutesOf(const nlohmann::json& line);
/// Of the line of a clip that was not dropped.
MotionStatistics StatisticsOf(const nlohmann::json& line);

}  // namespace holdfast::apps
