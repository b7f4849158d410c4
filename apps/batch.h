// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "geometry/jobs/job_list.h"

namespace holdfast::apps {

/// A command that can be run for a list.
struct BatchCommand {
  std::string name;
  /// Of the files that it writes, the first where a name has none; none: it writes folders.
  std::vector<std::string> extensions;
  std::function<void(CLI::App& app, int& exit_code)> add;
};

/// Adds the command and, to it, --batch LIST, --shard K/N and --retry-failed. With --batch the
/// arguments come from the list (ReadJobList), `key=value` there sets the option of that name for
/// that job, -o names the folder of all results, and each job runs the command in this process, on
/// one thread, as many at a time as there are threads (RunJobs).
void AddBatchable(CLI::App& app, const BatchCommand& command, int& exit_code);

/// A line as the command's arguments, for CLI::App::parse. Throws Error, naming the line, for too
/// few or too many of them and for a key that is no option.
std::vector<std::string> JobArguments(const CLI::App& command, const JobLine& line);

/// `command` (the program, or one of its commands) parses arguments of a line; what is wrong with
/// them is an Error that names the line.
void ParseJob(CLI::App& app, const std::vector<std::string>& arguments, const std::string& where);

}  // namespace holdfast::apps
