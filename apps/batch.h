// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "geometry/jobs/job_list.h"

namespace holdfast::apps {

/// A command that can run a list of jobs.
struct BatchCommand {
  std::string name;
  /// Extensions of output files; the first is appended to names without one. Empty: writes folders.
  std::vector<std::string> extensions;
  std::function<void(CLI::App& app, int& exit_code)> add;
};

/// Adds the command, with options --batch LIST, --shard K/N and --retry-failed. With --batch, the
/// arguments come from the list (ReadJobList); `key=value` sets the option of that name for one
/// job; -o names the folder of all results. Jobs run in this process, one thread each, as many
/// concurrently as there are threads (RunJobs).
void AddBatchable(CLI::App& app, const BatchCommand& command, int& exit_code);

/// Converts a line to the command's arguments for CLI::App::parse. Throws Error naming the line for
/// too few or too many arguments, and for unknown keys.
std::vector<std::string> JobArguments(const CLI::App& command, const JobLine& line);

/// Parses the arguments of a line with `app` (the program or a command). Parse errors are thrown as
/// an Error that names the line.
void ParseJob(CLI::App& app, const std::vector<std::string>& arguments, const std::string& where);

}  // namespace holdfast::apps
