// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/CLI.hpp>

namespace holdfast::apps {

/// Adds --config FILE, which sets options and arguments of `command` that the command line does
/// not, and --print-config, which prints those that are set as such a file and ends the program.
/// docs/commands.md has the format. What is wrong with the file is an Error that names it, the line
/// and the key.
void AddConfigOptions(CLI::App& command);

}  // namespace holdfast::apps
