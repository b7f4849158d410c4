// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <span>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "geometry/report/report_page.h"

namespace holdfast::apps {

/// Writes the report page of clips (MakeReportPage) atomically; writes nothing after Ctrl-C.
ReportPage WriteReport(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       ReportPageOptions options, const CommonOptions& common);

/// Same, into the result folder of a command. Prints a note instead of writing the report if there
/// is no player, or after Ctrl-C, which keeps the results written before.
void WriteReportBeside(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       const CommonOptions& common);

/// A folder that is written atomically: files go into a hidden sibling folder, which Commit()
/// renames. Without Commit (an error, Ctrl-C, a full disk) nothing is left.
class ResultFolder {
 public:
  /// Throws Error if `path` exists and `force` is false, or if it cannot be created there.
  ResultFolder(std::filesystem::path path, bool force);
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  /// Path to which a file of this name has to be written.
  std::filesystem::path operator/(const char* name) const;

  /// Writes metrics.json, and its wall times to timing.json, so that all other files are identical
  /// in every run. Batch jobs write no timing.json. Returns the content of metrics.json.
  nlohmann::json WriteMetrics(nlohmann::json metrics) const;

  /// Renames the folder to its final name. With `force`, an existing folder is replaced once the
  /// new one is complete.
  void Commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
};

/// From now on, Ctrl-C requests a clean stop (Interrupted()); a second one kills the program.
void WatchForInterrupt();

/// Thrown if interrupted work cannot simply return.
struct Stopped {};

}  // namespace holdfast::apps
