// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace holdfast::apps {

/// All commands right below one, on the command line or not.
std::vector<const CLI::App*> Subcommands(const CLI::App& app);

/// The one door for numbers of the command line: CLI11's ranges let NaN through, an option without
/// a range anything, and whole numbers end at the largest that there is.
void RequireNumbersInRange(CLI::App& app);

/// Thrown where a command has done its work while the command line is still being parsed.
struct Ended {
  int exit_code;
};

/// Parses the command line and runs the command it names; `exit_code` is what the commands of `app`
/// write theirs to. Errors go to stderr, after `name`; returns the program's exit code.
int RunProgram(CLI::App& app, std::string_view name, int argc, char** argv, const int& exit_code);

/// A bash script that completes commands, options, values that an option lists, embedded objects
/// and file names: `source <(holdfast --bash-completion)`.
std::string BashCompletion(const CLI::App& app);

/// Adds --bash-completion, which prints that script.
void AddCompletionOption(CLI::App& app);

}  // namespace holdfast::apps
