// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace holdfast {

/// What is known of a job that was tried.
struct JobStatus {
  std::string hash;  ///< of what it asked then
  bool done = false;
  int exit_code = 0;
  int tries = 0;           ///< the status with the most is the last
  std::uint32_t file = 0;  ///< where the whole line is
  std::uint64_t offset = 0;
};

/// What came of jobs, as lines of JSON in a folder that any number of processes share. Each process
/// adds to a file of its own and reads those of all others; a line that was cut short by a kill or
/// a full disk does not count. Thread-safe; keeps about a hundred bytes for each job.
class JobJournal {
 public:
  /// `owner`: the name of this process's file. Reads what is there.
  JobJournal(std::filesystem::path folder, const std::string& owner);

  /// Reads what others added since.
  void Refresh();
  std::optional<JobStatus> Find(const std::string& name) const;
  /// The whole line of a status.
  nlohmann::json Line(const JobStatus& status) const;
  /// Adds a line: `line` with name, hash, status, exit_code and try. Throws Error when it cannot be
  /// written.
  void Append(const std::string& name, const std::string& hash, bool done, int exit_code,
              nlohmann::json line);

 private:
  struct File {
    std::filesystem::path path;
    std::uint64_t read = 0;
  };
  void ReadOn(std::uint32_t index);

  std::filesystem::path folder_, own_;
  mutable std::mutex lock_;
  std::vector<File> files_;
  std::map<std::string, JobStatus> jobs_;
};

}  // namespace holdfast
