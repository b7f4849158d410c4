// SPDX-License-Identifier: MIT
#include "apps/result_folder.h"

#include <unistd.h>

#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "apps/common.h"
#include "geometry/error.h"
#include "geometry/io/container/wall_times.h"

namespace holdfast::apps {

namespace fs = std::filesystem;

ResultFolder::ResultFolder(fs::path path, bool force) : path_(std::move(path)) {
  if (path_.empty()) throw Error("--output", "is an empty name", "Name the folder to make");
  if (path_.filename().empty()) path_ = path_.parent_path();  // "held/" is "held"
  std::error_code error;
  if (fs::exists(path_, error)) {
    if (!force) {
      throw Error(path_.string(), "exists already", "Choose another name, or give --force");
    }
    // Never replace a folder that is not one of ours.
    if (!fs::is_directory(path_, error) ||
        (!fs::is_empty(path_, error) && !fs::exists(path_ / "metrics.json", error))) {
      throw Error(path_.string(), "is not a result folder: it is not replaced",
                  "Choose another name");
    }
  }
  const fs::path parent = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
  temporary_ = parent / fmt::format(".{}.tmp{}", path_.filename().string(), ::getpid());
  // Tried now, so that a place that cannot be written to is said before the work and not after it;
  // made only when there is something to write, so that a killed program leaves nothing.
  fs::remove_all(temporary_, error);
  fs::create_directories(temporary_, error);
  if (error) {
    throw Error(path_.string(), fmt::format("cannot be created ({})", error.message()),
                "Check the folder it is to be in");
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
  if (IsOneOfMany()) fs::remove(*this / "timing.json");
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
    throw Error(path_.string(), fmt::format("could not be put in place ({})", error.message()),
                "Check the folder it is to be in");
  }
  temporary_.clear();
  if (replaces) fs::remove_all(old, error);
}

}  // namespace holdfast::apps
