// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace holdfast {

/// Last known status of a job that was tried.
struct JobStatus {
  std::string hash;  ///< hash of the job's inputs at that time
  bool done = false;
  int exit_code = 0;
  int tries = 0;           ///< the status with the highest count is the latest
  std::uint32_t file = 0;  ///< index of the file that holds the whole line
  std::uint64_t offset = 0;
};

/// Outcomes of jobs, stored as lines of JSON in a folder that any number of processes share. Each
/// process appends to its own file and reads the files of all others. A line truncated by a kill or
/// a full disk is ignored. Thread-safe; needs about a hundred bytes per job.
class JobJournal {
 public:
  /// `owner` names this process's file. Reads the existing status files.
  JobJournal(std::filesystem::path folder, const std::string& owner);

  /// Reads the lines that other processes have appended since the last call.
  void Refresh();
  std::optional<JobStatus> Find(const std::string& name) const;
  /// Returns the whole line of a status.
  nlohmann::json Line(const JobStatus& status) const;
  /// Appends `line` with name, hash, status, exit_code and try. Throws Error if it cannot be
  /// written.
  void Append(const std::string& name, const std::string& hash, bool done, int exit_code,
              nlohmann::json line);

 private:
  void ReadOn(std::uint32_t index);

  std::filesystem::path folder_, own_;
  mutable std::mutex lock_;
  std::vector<std::pair<std::filesystem::path, std::uint64_t>> files_;  // with the bytes read
  std::map<std::string, JobStatus> jobs_;
};

/// One of the processes that share a folder of locks. Works on NFS and on file systems without hard
/// links. A lock is a link to its owner's file, which identifies the owner (machine, boot, process
/// namespace, process, start) and counts heartbeats. The kernel knows whether an owner on this
/// machine lives. An owner elsewhere is dead if its count has not changed for `dead_after_s` on the
/// observer's own steady clock; clocks are never compared, so clock jumps do no harm.
///
/// A dead owner's lock is superseded, never removed: the process that creates its next generation
/// holds it. Only one can, so two processes that find the same dead owner do not both take over.
///
/// If two processes still do the same work (an owner resumes after being suspended for minutes),
/// the results stay valid as long as they are written atomically: locks only save work.
class JobOwner {
 public:
  /// `folder` must exist. Throws Error if nothing can be written there (a full disk).
  explicit JobOwner(std::filesystem::path folder, double dead_after_s = 60.0);
  ~JobOwner();
  JobOwner(const JobOwner&) = delete;
  JobOwner& operator=(const JobOwner&) = delete;

  /// Identifier that is unique among all processes of this and earlier boots.
  const std::string& Id() const { return id_; }

  /// Returns whether this process now holds the lock; false while a live one does. `took_over`: a
  /// dead owner had it; leftovers may exist. Thread-safe; only one thread may ask for a key.
  bool TryLock(const std::string& key, bool* took_over = nullptr);
  /// Releases the lock. Call it when the work is done and every process can see the result.
  void Unlock(const std::string& key);

  /// Removes files of dead owners. Must not run while other processes may start.
  void RemoveDead();

 private:
  std::filesystem::path File(const std::string& key, int generation) const;
  bool Link(const std::filesystem::path& lock) const;
  bool IsDead(const std::string& id);
  void Beat();

  std::filesystem::path folder_;
  double dead_after_s_;
  std::string machine_, id_;
  std::filesystem::path own_;
  std::mutex lock_;
  // Owners on other machines: the last heartbeat, and since when.
  std::map<std::string, std::pair<std::string, std::chrono::steady_clock::time_point>> seen_;
  std::map<std::string, int> held_;  // key to lock generation
  long beats_ = 0;
  std::condition_variable ends_;
  bool ended_ = false;
  std::thread heart_;
};

}  // namespace holdfast
