// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/jobs/job_journal.h"

namespace holdfast {

/// Folder of locks and status lines, which belong to the jobs and not to their results.
inline constexpr const char* kJobsFolder = ".jobs";

struct Job {
  std::string name;                   ///< unique in a list
  std::filesystem::path result;       ///< file or folder in the jobs' folder, written atomically
  std::vector<std::string> words;     ///< arguments as shown in the manifest
  std::function<std::string()> hash;  ///< hash of the inputs; called for this shard's jobs only
};

/// Outcome of one job.
struct JobOutcome {
  bool done = false;
  int exit_code = 0;  ///< may be nonzero for a job that is done with reservations
  std::string fault;
  nlohmann::json summary;  ///< without times: equal jobs have equal summaries
};

struct JobsOptions {
  std::filesystem::path folder;
  std::string kind;     ///< kind of jobs; a folder holds jobs of one kind
  nlohmann::json head;  ///< first entries of the manifest
  int shard = 1;  ///< from 1; runs every job whose place in the list is `shard` modulo `shards`
  int shards = 1;
  bool retry_failed = false;
  bool replace = false;  ///< overwrite results of other options or inputs
  int threads = 1;       ///< number of jobs that run at the same time
};

struct JobsReport {
  int jobs = 0;       ///< jobs of this shard
  int before = 0;     ///< jobs done or failed in an earlier run or by another process
  int failed = 0;     ///< failed jobs of this shard
  int exit_code = 0;  ///< 1 if any job's exit code is 1, else the largest exit code
  bool stopped = false;
  int unfinished = 0;  ///< jobs left in the whole list, including other shards
};

/// Runs the unfinished jobs of this shard, `threads` at a time. Other shards, other processes of
/// the same shard and remains of killed runs may be in the folder. `run` returns nullopt when it
/// was stopped, and must not throw. `told` (name, outcome, number of finished jobs) is called after
/// each job that was run, one call at a time, and may be null. `stop` is polled between jobs.
///
/// A job is done if its last status line has status done and the same hash, and its result exists.
/// A failed job is not tried again unless `retry_failed` is set or its hash has changed. Memory:
/// some hundred bytes per job.
///
/// When every job of the list is finished, `manifest.json` lists their outcomes in list order. Its
/// bytes depend on neither time nor processes.
///
/// Throws Error for a folder with other content, a job that is done with another hash (without
/// `replace`), a shard out of range, and a full disk.
JobsReport RunJobs(const std::vector<Job>& jobs, const JobsOptions& options,
                   const std::function<std::optional<JobOutcome>(std::size_t)>& run,
                   const std::function<void(const std::string&, const JobOutcome&, int)>& told,
                   const std::function<bool()>& stop);

}  // namespace holdfast
