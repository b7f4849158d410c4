// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace holdfast::apps {

/// Returns all direct subcommands, whether or not they are on the command line.
std::vector<const CLI::App*> Subcommands(const CLI::App& app);

/// Adds range checks to all numeric options. CLI11's ranges accept NaN, options without a range
/// accept anything, and out-of-range integers are clamped.
void RequireNumbersInRange(CLI::App& app);

/// Thrown if a command finished its work while the command line is still being parsed.
struct Ended {
  int exit_code;
};

/// Parses the command line and runs the command; `exit_code` is the variable that the commands of
/// `app` write. Errors go to stderr after `name`. Returns the exit code of the program.
int RunProgram(CLI::App& app, std::string_view name, int argc, char** argv, const int& exit_code);

/// Returns a bash script that completes commands, options, listed option values, embedded objects
/// and file names: `source <(holdfast --bash-completion)`.
std::string BashCompletion(const CLI::App& app);

/// Adds --bash-completion, which prints that script.
void AddCompletionOption(CLI::App& app);

}  // namespace holdfast::apps
