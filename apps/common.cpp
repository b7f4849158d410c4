// SPDX-License-Identifier: MIT
#include "apps/common.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include "geometry/parallel.h"

namespace holdfast::apps {

namespace fs = std::filesystem;

void AddCommonOptions(CLI::App& command, CommonOptions& options, bool writes,
                      std::string_view examples) {
  command.add_flag("--json", options.json, "Print the summary as JSON");
  command.add_flag("--quiet,-q", options.quiet, "No progress and no notes on stderr");
  AddOption(command, "--threads", options.threads, "Threads; 0: all cores that the process may use",
            CLI::Range(0, 1024));
  AddOption(command, "--seed", options.seed, "Seed of every random draw");
  if (writes) command.add_flag("--force,-f", options.force, "Overwrite what is there");
  command.footer(fmt::format("\nExamples:\n{}", examples));
}

int NumThreads(const CommonOptions& options) {
  if (options.threads > 0) return options.threads;
  return AvailableThreads();
}

void Note(const CommonOptions& options, std::string_view text) {
  if (!options.quiet) fmt::print(stderr, "{}\n", text);
}

Progress::Progress(const CommonOptions& options, std::string label)
    : shown_(!options.quiet),
      terminal_(::isatty(STDERR_FILENO) != 0),
      label_(std::move(label)),
      begin_(std::chrono::steady_clock::now()),
      last_(begin_) {}

Progress::~Progress() {
  if (line_open_) fmt::print(stderr, "\n");
}

void Progress::Update(int done, int total) {
  if (!shown_ || total <= 0) return;
  const auto now = std::chrono::steady_clock::now();
  const auto pause = terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000);
  if (now - last_ < pause && done < total) return;
  if (!terminal_ && now - begin_ < pause) return;  // short work leaves no trace in a log
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - begin_).count();
  const double left = done > 0 ? elapsed / done * (total - done) : 0.0;
  const std::string line = fmt::format("{}: {}/{}, {:.0f} s left", label_, done, total, left);
  if (terminal_) {
    fmt::print(stderr, "\r{:<78}", line);
    line_open_ = true;
  } else {
    fmt::print(stderr, "{}\n", line);
  }
}

std::shared_ptr<const BodyModel> LoadBody(const std::string& path) {
  return path.empty() ? BodyModel::Default() : BodyModel::Load(path);
}

void RequireNew(const fs::path& path, const CommonOptions& options) {
  RequireNewFolder(path, options);
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw Error(path.string(), "is a folder, a file is to be written", "Choose a file name");
  }
}

void RequireNewFolder(const fs::path& path, const CommonOptions& options) {
  if (path.empty()) throw Error("--output", "is an empty name", "Name what is to be written");
  std::error_code error;
  if (!options.force && fs::exists(path, error)) {
    throw Error(path.string(), "exists already", "Choose another name, or give --force");
  }
  fs::path above = fs::absolute(path, error).parent_path();
  while (!fs::exists(above, error) && above.has_relative_path()) above = above.parent_path();
  const bool folder = fs::is_directory(above, error);
  if (folder && ::access(above.c_str(), W_OK | X_OK) == 0) return;
  throw Error(path.string(),
              fmt::format("cannot be written: '{}' is {}", above.string(),
                          folder ? "read-only" : "not a folder"),
              "Choose another place");
}

nlohmann::json JsonHead(std::string_view schema, const CommonOptions& options) {
  return {{"schema", schema}, {"holdfast_version", HOLDFAST_VERSION}, {"seed", options.seed}};
}

void PrintResult(const CommonOptions& options, const nlohmann::json& summary,
                 std::string_view text) {
  if (options.json) {
    fmt::print("{}\n", summary.dump(2));
  } else {
    fmt::print("{}", text);
  }
  std::fflush(stdout);
}

}  // namespace holdfast::apps
