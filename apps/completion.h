// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace holdfast::apps {

/// A bash script that completes commands, options, values that an option lists, embedded objects
/// and file names: `source <(holdfast --bash-completion)`.
std::string BashCompletion(const CLI::App& app);

/// Adds --bash-completion, which prints that script.
void AddCompletionOption(CLI::App& app);

}  // namespace holdfast::apps
