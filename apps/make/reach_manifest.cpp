// SPDX-License-Identifier: MIT
#include "apps/make/reach_manifest.h"

#include <algorithm>

#include "geometry/error.h"
#include "geometry/io/container/read_json.h"

namespace holdfast::apps {

namespace fs = std::filesystem;
using nlohmann::json;

json QualityJson(const MotionQuality& quality) {
  return {{"frames", quality.frames},
          {"skate_ratio", quality.skate_ratio},
          {"lowest_sole_m", quality.lowest_sole_m},
          {"still_sole_m", quality.still_sole_m},
          {"airborne_ratio", quality.airborne_ratio},
          {"mean_acceleration_m_s2", quality.mean_acceleration},
          {"p99_acceleration_m_s2", quality.p99_acceleration},
          {"max_acceleration_m_s2", quality.max_acceleration},
          {"beyond_limits_ratio", quality.beyond_limits_ratio}};
}

json StatisticsJson(const MotionStatistics& statistics) {
  const auto shares = [](const auto& counts) {
    double total = 0.0;
    for (const long count : counts) total += static_cast<double>(count);
    json list = json::array();
    for (const long count : counts) {
      list.push_back(total > 0.0 ? static_cast<double>(count) / total : 0.0);
    }
    return list;
  };
  const double frames = static_cast<double>(std::max(1L, statistics.frames));
  return {{"minutes", static_cast<double>(statistics.frames) / MotionLibrary::kFrameRate / 60.0},
          {"skate_ratio", statistics.skating_frames / frames},
          {"pelvis_speed_shares_per_0.1_m_s", shares(statistics.pelvis_speed)},
          {"acceleration_shares_at_1_2_4_8_16_32_64_128_m_s2", shares(statistics.acceleration)}};
}

json CapturesJson(const std::vector<Capture>& captures) {
  json list = json::array();
  for (const Capture& capture : captures) {
    json entry = {{"file", capture.file},
                  {"subject", capture.subject},
                  {"category", capture.category},
                  {"split", capture.held_out ? "held_out" : "train"},
                  {"quality", QualityJson(capture.quality)}};
    if (!capture.fault.empty()) entry["dropped"] = capture.fault;
    list.push_back(std::move(entry));
  }
  return list;
}

std::string ManifestText(const json& head, const std::vector<json>& lines) {
  std::string text = head.dump(1);
  text.resize(text.size() - 2);  // "\n}"
  text += ",\n \"clips\": [";
  for (std::size_t k = 0; k < lines.size(); ++k) {
    text += (k == 0 ? "\n  " : ",\n  ") + lines[k].dump();
  }
  return text + "\n ]\n}\n";
}

std::vector<json> LinesBefore(const fs::path& manifest, const json& head, bool force) {
  if (!fs::exists(manifest)) return {};
  const json before = ReadJson(manifest);
  const auto same = [&](const char* key) {
    return before.is_object() && before.contains(key) && before[key] == head[key];
  };
  if (!same("schema")) {
    throw Error(manifest.string(), "is not a manifest of 'make-reach-data'",
                "Choose another folder");
  }
  json asked = head["options"], had = before.contains("options") ? before["options"] : json();
  if (!had.is_object()) had = json::object();
  asked.erase("hours");  // more of the same may be asked for
  had.erase("hours");
  const bool same_making = same("seed") && same("holdfast_version") && same("captures") &&
                           same("body") && asked == had && before.contains("clips");
  if (!same_making) {
    if (force) return {};
    throw Error(manifest.string(), "is of other captures, options, seed or version",
                "Choose another folder, or give --force to make it anew");
  }
  return UseJson(manifest, [&] {
    std::vector<json> lines(before["clips"].begin(), before["clips"].end());
    for (const json& line : lines) {  // looked at now, not after hours of work
      if (!line.contains("file")) continue;
      MinutesOf(line);
      StatisticsOf(line);
      for (const json& reach : line.at("reaches")) reach.at("how").get<std::string>();
    }
    return lines;
  });
}

double MinutesOf(const json& line) {
  return line.contains("file") ? line.at("frames").get<double>() / MotionLibrary::kFrameRate / 60.0
                               : 0.0;
}

MotionStatistics StatisticsOf(const json& line) {
  MotionStatistics statistics;
  statistics.frames = line.at("frames").get<long>();
  statistics.skating_frames = line.at("statistics").at("skating_frames").get<double>();
  statistics.pelvis_speed = line.at("statistics").at("pelvis_speed").get<SpeedHistogram>();
  statistics.acceleration = line.at("statistics").at("acceleration").get<AccelerationHistogram>();
  return statistics;
}

}  // namespace holdfast::apps
