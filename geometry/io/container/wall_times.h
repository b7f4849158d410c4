// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

namespace holdfast {

/// Removes the wall times from a result and returns them, at the same places: an object of the keys
/// that held times, a list with a null for each element without any. Null where `result` has none.
/// A result without its times has the same bytes in every run. Keys that hold times are those of
/// the list in wall_times.cpp.
nlohmann::json TakeWallTimes(nlohmann::json& result);

/// Puts `times` of TakeWallTimes back into `result`. Throws nlohmann::json::exception where a list
/// has another length than it had.
void PutBackWallTimes(const nlohmann::json& times, nlohmann::json& result);

/// Writes `result` without its wall times to `file`, and these to `times_file` (none is written for
/// a result without times). Returns what `file` has.
nlohmann::json WriteWithoutWallTimes(nlohmann::json result, const std::filesystem::path& file,
                                     const std::filesystem::path& times_file);

}  // namespace holdfast
