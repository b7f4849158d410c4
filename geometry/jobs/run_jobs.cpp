// SPDX-License-Identifier: MIT
#include "geometry/jobs/run_jobs.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/jobs/job_journal.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "manifest.json";
constexpr std::uintmax_t kMinBytes = 1 << 20;
constexpr const char* kSchema = "holdfast/jobs/1";

// Creates the folder, or checks that it holds jobs of this kind.
fs::path PrepareFolder(const fs::path& folder, const std::string& kind) {
  std::error_code error;
  const fs::path hidden = folder / kJobsFolder, about = hidden / "jobs.json";
  if (fs::exists(folder, error) && !fs::exists(hidden, error) &&
      (!fs::is_directory(folder, error) || !fs::is_empty(folder, error))) {
    throw Error(folder.string(), "is not the folder of a batch: nothing is written there",
                "Choose another name");
  }
  fs::create_directories(hidden, error);
  if (error) {
    throw Error(folder.string(), fmt::format("cannot be created ({})", error.message()),
                "Check its parent folder");
  }
  const nlohmann::json head = {{"schema", kSchema}, {"kind", kind}};
  if (!fs::exists(about)) {
    WriteAtomically(about, JsonText(head) + "\n");
  } else if (ReadJson(about) != head) {
    throw Error(folder.string(), fmt::format("holds results of a command other than '{}'", kind),
                "Choose another folder");
  }
  return hidden;
}

// Removes temporary files of a process that was killed while writing this result.
void RemoveLeftovers(const fs::path& result) {
  std::error_code ignored;
  const std::string whole = "." + result.filename().string() + ".tmp";
  const std::string stem = "." + result.stem().string() + ".tmp";
  std::vector<fs::path> left;
  for (const fs::directory_entry& entry : fs::directory_iterator(result.parent_path(), ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(whole) || name.starts_with(stem)) left.push_back(entry.path());
  }
  for (const fs::path& path : left) fs::remove_all(path, ignored);
}

class JobRunner {
 public:
  using Run = std::function<std::optional<JobOutcome>(std::size_t)>;
  using Told = std::function<void(const std::string&, const JobOutcome&, int)>;

  JobRunner(const std::vector<Job>& jobs, const JobsOptions& options, const Run& run,
            const Told& told, const std::function<bool()>& stop)
      : jobs_(jobs),
        options_(options),
        run_(run),
        told_(told),
        stop_(stop),
        hidden_(PrepareFolder(options.folder, options.kind)),
        owner_(hidden_),
        journal_(hidden_, owner_.Id()) {}

  JobsReport RunAll() {
    const std::vector<std::size_t> open = OpenJobs();
    const int most = std::max(1, options_.threads);
    ParallelFor(static_cast<int>(open.size()), most, [&](int k) {
      const std::size_t job = open[static_cast<std::size_t>(k)];
      if (Stopped() || Try(job)) return;
      const std::lock_guard guard(lock_);
      elsewhere_.push_back(job);
    });
    while (!elsewhere_.empty() && !Stopped()) WaitForOthers();
    report_.stopped = Stopped();
    Conclude();
    return report_;
  }

 private:
  bool Stopped() const { return stop_ && stop_(); }

  // Whether the job is done, or failed and is not to be tried again.
  bool IsSettled(std::size_t job) const {
    const std::optional<JobStatus> status = journal_.Find(jobs_[job].name);
    if (!status || status->hash != hashes_[job]) return false;
    std::error_code ignored;
    if (status->done) return fs::exists(jobs_[job].result, ignored);
    const auto first = tries_before_.find(job);
    const int before = first == tries_before_.end() ? 0 : first->second;
    return !options_.retry_failed || status->tries > before;
  }

  // Returns this shard's jobs to run, after checking that all of them may be run.
  std::vector<std::size_t> OpenJobs() {
    hashes_.resize(jobs_.size());
    std::vector<std::size_t> open;
    for (std::size_t k = 0; k < jobs_.size(); ++k) {
      if (static_cast<int>(k % static_cast<std::size_t>(options_.shards)) != options_.shard - 1) {
        continue;
      }
      ++report_.jobs;
      hashes_[k] = jobs_[k].hash();
      const std::optional<JobStatus> status = journal_.Find(jobs_[k].name);
      if (status && status->done && status->hash != hashes_[k] && !options_.replace) {
        throw Error(options_.folder.string(),
                    fmt::format("holds results of another list, options, seed or version: the "
                                "configuration of '{}' differs",
                                jobs_[k].name),
                    "Choose another folder, or give --force to replace them");
      }
      if (status) tries_before_[k] = status->tries;
      if (IsSettled(k)) {
        ++report_.before;
      } else {
        open.push_back(k);
      }
    }
    return open;
  }

  // Returns false while another process holds the job's lock.
  bool Try(std::size_t index) {
    const Job& job = jobs_[index];
    bool took_over = false;
    if (!owner_.TryLock(job.name, &took_over)) return false;
    journal_.Refresh();  // another process may have finished it
    if (IsSettled(index)) {
      const std::lock_guard guard(lock_);
      ++report_.before;
      owner_.Unlock(job.name);
      return true;
    }
    if (took_over) RemoveLeftovers(job.result);
    const auto begin = std::chrono::steady_clock::now();
    std::optional<JobOutcome> outcome = run_(index);
    if (!outcome) return true;  // stopped: keep the lock, the next process supersedes it
    RequireSpace(*outcome);
    nlohmann::json line = {
        {"seconds",
         std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()}};
    if (!outcome->fault.empty()) line["fault"] = outcome->fault;
    if (!outcome->summary.is_null()) line["summary"] = outcome->summary;
    journal_.Append(job.name, hashes_[index], outcome->done, outcome->exit_code, std::move(line));
    owner_.Unlock(job.name);
    const std::lock_guard guard(lock_);
    ++finished_;
    if (told_) told_(job.name, *outcome, report_.before + finished_);
    return true;
  }

  // On a full disk every job fails, so these failures do not count as failures of the jobs.
  void RequireSpace(const JobOutcome& outcome) const {
    if (outcome.done) return;
    std::error_code unknown;
    const fs::space_info space = fs::space(options_.folder, unknown);
    if (unknown || space.available >= kMinBytes) return;
    throw Error(options_.folder.string(),
                fmt::format("could not be written (the disk is full; {})", outcome.fault),
                "Free some space and start again: finished jobs are kept");
  }

  // Retries the jobs that another process holds, until they are done or their owner is dead.
  void WaitForOthers() {
    std::vector<std::size_t> still;
    for (const std::size_t job : std::exchange(elsewhere_, {})) {
      if (Stopped() || !Try(job)) still.push_back(job);
    }
    elsewhere_ = std::move(still);
    if (!elsewhere_.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }

  void Conclude() {
    journal_.Refresh();
    int worst = 0;
    for (std::size_t k = 0; k < jobs_.size(); ++k) {
      const std::optional<JobStatus> status = journal_.Find(jobs_[k].name);
      if (!status || (!hashes_[k].empty() && status->hash != hashes_[k])) {
        ++report_.unfinished;
        continue;
      }
      if (hashes_[k].empty()) continue;  // job of another shard
      report_.failed += !status->done || status->exit_code != 0;
      if (worst != 1 && status->exit_code != 0) {
        worst = status->exit_code == 1 ? 1 : std::max(worst, status->exit_code);
      }
    }
    report_.exit_code = worst;
    if (report_.unfinished > 0 || report_.stopped) return;
    if (!owner_.TryLock(kManifest)) return;  // another process writes the same bytes
    owner_.RemoveDead();
    WriteManifest();
    owner_.Unlock(kManifest);
  }

  // Writes one job per line and keeps only the current line in memory.
  void WriteManifest() {
    nlohmann::json head = options_.head;
    head["kind"] = options_.kind;
    int failed = 0;
    WriteAtomically(options_.folder / kManifest, [&](const fs::path& temporary) {
      std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
      std::string text = JsonText(head);
      text.back() = ',';
      out << text << "\n \"jobs\": [";
      for (std::size_t k = 0; k < jobs_.size(); ++k) {
        const JobStatus status = journal_.Find(jobs_[k].name).value();
        nlohmann::json line = journal_.Line(status);
        for (const char* changes : {"seconds", "hash", "try"}) line.erase(changes);
        line["arguments"] = jobs_[k].words;
        failed += !status.done || status.exit_code != 0;
        out << (k == 0 ? "\n  " : ",\n  ") << JsonText(line);
      }
      out << "],\n \"failed\": " << failed << "}\n";
      out.close();
      if (!out) {
        throw Error((options_.folder / kManifest).string(), "could not be written",
                    "Free some space and start again: finished jobs are kept");
      }
    });
  }

  const std::vector<Job>& jobs_;
  const JobsOptions& options_;
  const Run& run_;
  const Told& told_;
  const std::function<bool()>& stop_;
  const fs::path hidden_;
  JobOwner owner_;
  JobJournal journal_;
  std::mutex lock_;
  std::vector<std::string> hashes_;  // empty for other shards' jobs
  std::map<std::size_t, int> tries_before_;
  std::vector<std::size_t> elsewhere_;
  int finished_ = 0;
  JobsReport report_;
};

}  // namespace

JobsReport RunJobs(const std::vector<Job>& jobs, const JobsOptions& options,
                   const std::function<std::optional<JobOutcome>(std::size_t)>& run,
                   const std::function<void(const std::string&, const JobOutcome&, int)>& told,
                   const std::function<bool()>& stop) {
  if (options.shards < 1 || options.shard < 1 || options.shard > options.shards) {
    throw Error(fmt::format("shard {}/{}", options.shard, options.shards), "is out of range",
                "Shards go from 1/N to N/N");
  }
  return JobRunner(jobs, options, run, told, stop).RunAll();
}

}  // namespace holdfast
