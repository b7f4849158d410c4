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

/// Where what belongs to the jobs, and not to their results, is kept: locks and status lines.
inline constexpr const char* kJobsFolder = ".jobs";

struct Job {
  std::string name;                   ///< no two have the same
  std::filesystem::path result;       ///< file or folder in the jobs' folder, written atomically
  std::vector<std::string> words;     ///< what it asks, for people: told in the manifest
  std::function<std::string()> hash;  ///< of what it asks; called for this shard's jobs only
};

/// What came of one job.
struct JobOutcome {
  bool done = false;
  int exit_code = 0;  ///< of a job that is done with reservations, too
  std::string fault;
  nlohmann::json summary;  ///< without times: equal jobs, equal summaries
};

struct JobsOptions {
  std::filesystem::path folder;
  std::string kind;     ///< of jobs: a folder holds jobs of one kind
  nlohmann::json head;  ///< what the manifest begins with
  int shard = 1;  ///< of `shards`, from 1: every job whose place in the list is shard modulo shards
  int shards = 1;
  bool retry_failed = false;
  bool replace = false;  ///< results of other options or inputs
  int threads = 1;       ///< jobs at a time
  JobOwnerOptions owner;
};

struct JobsReport {
  int jobs = 0;       ///< of this shard
  int before = 0;     ///< done or failed by an earlier run, or by another process
  int failed = 0;     ///< of `jobs`
  int exit_code = 0;  ///< 1 where a job's is 1, else the largest
  bool stopped = false;
  int unfinished = 0;  ///< of the whole list, other shards' too
};

/// Runs the jobs of this shard that are not done, `threads` at a time, whatever else runs in the
/// folder: other shards, the same one, killed ones before. `run` gives nothing when it was stopped,
/// and throws nothing. `told` (name, outcome, jobs finished) is called for each one that was run,
/// one at a time, and may be null; `stop` is asked between jobs.
///
/// A job is done when its last status line states it with the same hash and its result is there.
/// One that failed is not tried again unless asked for, or it asks something else now. Memory: some
/// hundred bytes a job.
///
/// When no job of the list is left, `manifest.json` says in the list's order what came of each,
/// in bytes that depend on neither time nor processes.
///
/// Throws Error for a folder of something else, a job that is done with another hash (without
/// `replace`), a shard out of range, and a disk that is full.
JobsReport RunJobs(const std::vector<Job>& jobs, const JobsOptions& options,
                   const std::function<std::optional<JobOutcome>(std::size_t)>& run,
                   const std::function<void(const std::string&, const JobOutcome&, int)>& told,
                   const std::function<bool()>& stop);

}  // namespace holdfast
