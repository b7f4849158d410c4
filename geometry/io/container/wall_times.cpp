// SPDX-License-Identifier: MIT
#include "geometry/io/container/wall_times.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_text.h"

namespace holdfast {
namespace {

constexpr std::array<std::string_view, 18> kWallTimeKeys = {"closing_ms",
                                                            "core_s",
                                                            "finishing_seconds_median",
                                                            "frames_per_s",
                                                            "made_ms",
                                                            "ms_per_frame",
                                                            "ms_slowest_frame",
                                                            "processor_seconds",
                                                            "refinement_ms",
                                                            "search_ms",
                                                            "seconds",
                                                            "seconds_at",
                                                            "seconds_mean",
                                                            "seconds_median",
                                                            "solve_ms",
                                                            "solve_ms_median",
                                                            "start_ms",
                                                            "success_by_seconds"};

}  // namespace

nlohmann::json TakeWallTimes(nlohmann::json& result) {
  nlohmann::json times;
  if (result.is_object()) {
    for (auto item = result.begin(); item != result.end();) {
      if (std::ranges::find(kWallTimeKeys, item.key()) != kWallTimeKeys.end()) {
        times[item.key()] = std::move(item.value());
        item = result.erase(item);
        continue;
      }
      if (nlohmann::json inner = TakeWallTimes(item.value()); !inner.is_null()) {
        times[item.key()] = std::move(inner);
      }
      ++item;
    }
  } else if (result.is_array() && !result.empty() && result.front().is_structured()) {
    bool any = false;
    nlohmann::json list = nlohmann::json::array();
    for (nlohmann::json& element : result) {
      list.push_back(TakeWallTimes(element));
      any |= !list.back().is_null();
    }
    if (any) times = std::move(list);
  }
  return times;
}

void PutBackWallTimes(const nlohmann::json& times, nlohmann::json& result) {
  if (times.is_object()) {
    for (const auto& [key, value] : times.items()) {
      if (result.contains(key)) {
        PutBackWallTimes(value, result[key]);
      } else {
        result[key] = value;
      }
    }
  } else if (times.is_array()) {
    if (times.size() != result.size()) {
      throw nlohmann::json::other_error::create(501, "lists differ in length", nullptr);
    }
    for (std::size_t i = 0; i < times.size(); ++i) PutBackWallTimes(times[i], result[i]);
  }
}

nlohmann::json WriteWithoutWallTimes(nlohmann::json result, const std::filesystem::path& file,
                                     const std::filesystem::path& times_file) {
  const nlohmann::json times = TakeWallTimes(result);
  WriteAtomically(file, JsonText(result, 1) + "\n");
  if (!times.is_null()) WriteAtomically(times_file, JsonText(times, 1) + "\n");
  return result;
}

}  // namespace holdfast
