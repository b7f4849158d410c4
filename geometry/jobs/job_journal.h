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

struct JobOwnerOptions {
  double beat_s = 5.0;         ///< between two heartbeats
  double dead_after_s = 60.0;  ///< an owner elsewhere whose heartbeat stands still so long is dead
};

/// This process among those that share a folder of locks; it works on NFS, and on file systems
/// without hard links. A lock is a link to its owner's file, which says who that is (machine, boot,
/// name space of processes, process, start) and counts heartbeats. Whether an owner on this machine
/// lives, the kernel says; one elsewhere is dead when its count has stood still for `dead_after_s`
/// of the observer's own steady clock: no clock is compared with another, so none can jump.
///
/// A dead owner's lock is never removed but outbid: who makes the next generation of it has it.
/// Only one can, so two that find the same dead owner do not both take over.
///
/// Should two nevertheless do the same work (an owner that was suspended for minutes and woke up),
/// nothing breaks as long as results are written atomically: locks save work, no more.
class JobOwner {
 public:
  /// `folder` exists. Throws Error when nothing can be written there (a full disk).
  explicit JobOwner(std::filesystem::path folder, JobOwnerOptions options = {});
  ~JobOwner();
  JobOwner(const JobOwner&) = delete;
  JobOwner& operator=(const JobOwner&) = delete;

  /// Unlike that of any other process, of this boot or before.
  const std::string& Id() const { return id_; }

  /// Whether the lock is this process's now; false while a live one has it. `took_over`: from a
  /// dead one, whose leftovers may lie about. Thread-safe; of one key only one thread may ask.
  bool TryLock(const std::string& key, bool* took_over = nullptr);
  /// The work is done, and everybody can see that it is.
  void Unlock(const std::string& key);

  /// Removes what dead owners of this machine left. Not while others may start.
  void RemoveDead();

 private:
  struct Seen {
    std::string beat;
    std::chrono::steady_clock::time_point since;
  };
  std::filesystem::path File(const std::string& key, int generation) const;
  bool Link(const std::filesystem::path& lock) const;
  bool IsDead(const std::string& id);
  void Beat();

  std::filesystem::path folder_;
  JobOwnerOptions options_;
  std::string machine_, id_;
  std::filesystem::path own_;
  std::mutex lock_;
  std::map<std::string, Seen> seen_;  // owners elsewhere
  std::map<std::string, int> held_;   // keys, with their generation
  long beats_ = 0;
  std::condition_variable ends_;
  bool ended_ = false;
  std::thread heart_;
};

}  // namespace holdfast
