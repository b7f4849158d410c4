// SPDX-License-Identifier: MIT
#include "apps/output.h"

#include <unistd.h>
#include <atomic>
#include <csignal>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "apps/common.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"

namespace holdfast::apps {
ReportPage WriteReport(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       ReportPageOptions options, const CommonOptions& common) {
  if (Interrupted()) return {};
  options.seed = common.seed;
  options.threads = NumThreads(common);
  Progress progress(common, "report");
  ReportPage page = MakeReportPage(clips, options, [&](const char*, int done, int total) {
    progress.Update(done, total);
    return !Interrupted();
  });
  if (!page.html.empty()) WriteAtomically(path, page.html);
  return page;
}

void WriteReportBeside(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       const CommonOptions& common) {
  if (HasReportPlayer()) {
    WriteReport(clips, path, {}, common);
    if (Interrupted())
      Note(common, "note: interrupted: the result is kept, but report.html is missing");
  } else {
    Note(common, "note: no report.html: this program was built without the player");
  }
}

namespace fs = std::filesystem;

ResultFolder::ResultFolder(fs::path path, bool force) : path_(std::move(path)) {
  if (path_.empty()) throw Error("--output", "is empty", "Give the name of the output folder");
  if (path_.filename().empty()) path_ = path_.parent_path();  // "held/" is "held"
  std::error_code error;
  if (fs::exists(path_, error)) {
    if (!force) {
      throw Error(path_.string(), "exists already", "Choose another name, or give --force");
    }
    // Folders not written by this program are never replaced.
    if (!fs::is_directory(path_, error) ||
        (!fs::is_empty(path_, error) && !fs::exists(path_ / "metrics.json", error))) {
      throw Error(path_.string(), "is not a result folder and is not replaced",
                  "Choose another name");
    }
  }
  const fs::path parent = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
  temporary_ = parent / fmt::format(".{}.tmp{}", path_.filename().string(), ::getpid());
  // Tests writability before the work starts. The folder is created again only when there is
  // something to write, so that a killed program leaves nothing behind.
  fs::remove_all(temporary_, error);
  fs::create_directories(temporary_, error);
  if (error) {
    throw Error(path_.string(), fmt::format("cannot be created ({})", error.message()),
                "Check its parent folder");
  }
  fs::remove(temporary_, error);
}

fs::path ResultFolder::operator/(const char* name) const {
  fs::create_directories(temporary_);
  return temporary_ / name;
}

ResultFolder::~ResultFolder() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

nlohmann::json ResultFolder::WriteMetrics(nlohmann::json metrics) const {
  nlohmann::json written =
      WriteWithoutWallTimes(std::move(metrics), *this / "metrics.json", *this / "timing.json");
  if (InBatch()) fs::remove(*this / "timing.json");
  return written;
}

void ResultFolder::Commit() {
  std::error_code error;
  const fs::path old = temporary_.string() + ".old";
  const bool replaces = fs::exists(path_, error);
  if (replaces) fs::rename(path_, old, error);
  if (!error) fs::rename(temporary_, path_, error);
  if (error) {
    std::error_code ignored;
    if (replaces) fs::rename(old, path_, ignored);
    throw Error(path_.string(), fmt::format("cannot be moved into place ({})", error.message()),
                "Check its parent folder");
  }
  temporary_.clear();
  if (replaces) fs::remove_all(old, error);
}

namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void OnInterrupt(int signal) {
  interrupted = true;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void WatchForInterrupt() { std::signal(SIGINT, OnInterrupt); }

bool Interrupted() { return interrupted; }

}  // namespace holdfast::apps
