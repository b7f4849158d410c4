// SPDX-License-Identifier: MIT
#include "apps/fit/fit_batch.h"

#include <mutex>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "apps/job_list.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/read_json.h"
#include "geometry/parallel.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "manifest.json";

// What became of one job.
struct Entry {
  bool done = false;
  bool was_done = false;  // by an earlier run
  int exit_code = kDone;
  std::string fault;
  nlohmann::json summary;
};

// The jobs as the manifest names them: what must agree for a batch to be continued.
nlohmann::json JobsJson(const std::vector<FitJob>& jobs) {
  nlohmann::json list = nlohmann::json::array();
  for (const FitJob& job : jobs) {
    list.push_back({{"name", job.output}, {"options", FitOptionsJson(job)}});
  }
  return list;
}

// Makes the folder, or finds in it the batch that is to be continued.
void Prepare(const fs::path& folder, const nlohmann::json& head, const CommonOptions& common) {
  std::error_code error;
  const fs::path manifest = folder / kManifest;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error)) {
    const nlohmann::json before =
        fs::exists(manifest) ? ReadJson(manifest) : nlohmann::json(nullptr);
    if (!before.contains("schema") || before["schema"] != head["schema"]) {
      throw Error(folder.string(), "is not the folder of a batch: nothing is written there",
                  "Choose another name");
    }
    const bool same =
        before.value("jobs_asked", nlohmann::json()) == head["jobs_asked"] &&
        before.value("seed", nlohmann::json()) == head["seed"] &&
        before.value("holdfast_version", nlohmann::json()) == head["holdfast_version"];
    if (!same && !common.force) {
      throw Error(folder.string(), "holds results of another list, options, seed or version",
                  "Choose another folder, or give --force to make them anew");
    }
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      const bool left_over = name.starts_with(".") && name.find(".tmp") != std::string::npos;
      const bool stale = !same && entry.is_directory() && fs::exists(entry.path() / "metrics.json");
      if (left_over || stale) fs::remove_all(entry.path(), error);
    }
    if (same) return;
  }
  fs::create_directories(folder, error);
  if (error) {
    throw Error(folder.string(), fmt::format("cannot be created ({})", error.message()),
                "Check the folder it is to be in");
  }
  WriteAtomically(manifest, head.dump(1) + "\n");
}

Entry RunOne(const FitJob& job, const fs::path& folder, const CommonOptions& common,
             FitLibrary& library) {
  Entry entry;
  const fs::path result = folder / job.output;
  try {
    if (fs::exists(result / "metrics.json")) {
      entry.was_done = true;
    } else {
      FitJob placed = job;
      placed.output = result.string();
      CommonOptions alone = common;
      alone.quiet = true;
      alone.threads = 1;
      alone.force = true;
      entry.exit_code = RunFitJob(placed, alone, library).exit_code;
      if (Interrupted()) return entry;
    }
    const nlohmann::json metrics = ReadJson(result / "metrics.json");
    if (!metrics.is_object() || !metrics.contains("summary")) {
      throw Error((result / "metrics.json").string(), "is damaged", "Remove its folder");
    }
    entry.summary = metrics["summary"];
    entry.done = true;
    if (UseJson(result / "metrics.json", [&] { return entry.summary.value("frames_failed", 0); })) {
      entry.exit_code = kFitFault;
      entry.fault = "some frames could not be solved";
    }
  } catch (const FitFailure& failure) {
    entry.exit_code = kFitFault;
    entry.fault = failure.what();
  } catch (const std::exception& error) {
    entry.exit_code = kInputFault;
    entry.fault = error.what();
  }
  return entry;
}

}  // namespace

Outcome RunFitBatch(const fs::path& list, const fs::path& folder, const FitJob& common_job,
                    const CommonOptions& common) {
  FitJob shared = common_job;
  shared.write_timings = false;
  shared.write_report = false;  // megabytes each: made for those that somebody looks at
  const std::vector<FitJob> jobs = ReadJobList(list, shared);
  nlohmann::json manifest = JsonHead("holdfast/fit-batch/1", common);
  manifest["jobs_asked"] = JobsJson(jobs);
  Prepare(folder, manifest, common);

  FitLibrary library;
  std::vector<Entry> entries(jobs.size());
  std::mutex lock;
  int finished = 0, failed = 0;
  Progress progress(common, "fits");
  ParallelFor(static_cast<int>(jobs.size()), NumThreads(common), [&](int k) {
    if (Interrupted()) return;
    const auto index = static_cast<std::size_t>(k);
    entries[index] = RunOne(jobs[index], folder, common, library);
    const std::scoped_lock guard(lock);
    ++finished;
    if (!entries[index].fault.empty()) {
      ++failed;
      Note(common, fmt::format("{}: {}", jobs[index].output, entries[index].fault));
    }
    progress.Update(finished, static_cast<int>(jobs.size()));
  });
  if (Interrupted()) return {kInterrupted, {}, {}};

  int done_before = 0, exit_code = kDone;
  manifest["jobs"] = nlohmann::json::array();
  for (std::size_t k = 0; k < jobs.size(); ++k) {
    const Entry& entry = entries[k];
    nlohmann::json line = {{"name", jobs[k].output},
                           {"clip", jobs[k].clip},
                           {"object", jobs[k].object},
                           {"status", entry.done ? "done" : "failed"}};
    if (!entry.fault.empty()) line["fault"] = entry.fault;
    if (entry.done) line["summary"] = entry.summary;
    manifest["jobs"].push_back(std::move(line));
    done_before += entry.was_done;
    if (entry.exit_code != kDone && exit_code != kInputFault) exit_code = entry.exit_code;
  }
  manifest["failed"] = failed;
  WriteAtomically(folder / kManifest, manifest.dump(1) + "\n");

  Outcome outcome;
  outcome.exit_code = exit_code;
  outcome.text =
      fmt::format("{}: {} fits, {} failed{}\n", (folder / kManifest).string(), jobs.size(), failed,
                  done_before > 0 ? fmt::format(" ({} were there already)", done_before) : "");
  manifest["output"] = folder.string();
  outcome.summary = std::move(manifest);
  return outcome;
}

}  // namespace holdfast::apps
