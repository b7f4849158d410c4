// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

namespace holdfast::apps {

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

}  // namespace holdfast::apps
