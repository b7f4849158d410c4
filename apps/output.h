// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "geometry/report/report_page.h"

namespace holdfast::apps {

/// "640x480" as a pair of numbers from 1 to 16384; nothing for anything else.
std::optional<std::pair<int, int>> ParsePair(const std::string& text);

/// Writes the clips' page (MakeReportPage) atomically; nothing after Ctrl-C.
ReportPage WriteReport(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       ReportPageOptions options, const CommonOptions& common);

/// For commands that make clips: the same into their result's folder. Without the player there is a
/// note instead of a report, as there is after Ctrl-C: what was made until then is kept.
void WriteReportBeside(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       const CommonOptions& common);

/// A folder that is written atomically: files go into a hidden sibling, and Commit()
/// renames it. Without Commit (an error, Ctrl-C, a full disk) nothing is left.
class ResultFolder {
 public:
  /// Throws Error when `path` exists and `force` is false, or when it cannot be created there.
  ResultFolder(std::filesystem::path path, bool force);
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  /// Where to write a file of this name now.
  std::filesystem::path operator/(const char* name) const;

  /// Writes metrics.json, and its wall times to timing.json: all else has the same bytes in every
  /// run. One job of many writes no timing.json. Returns what metrics.json has.
  nlohmann::json WriteMetrics(nlohmann::json metrics) const;

  /// Makes the folder visible under its name. With `force`, what was there is replaced, after the
  /// new one is complete.
  void Commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
};

/// From now on Ctrl-C asks for a clean stop (Interrupted()); a second one kills the program.
void WatchForInterrupt();

/// Thrown where interrupted work cannot just return.
struct Stopped {};

}  // namespace holdfast::apps
