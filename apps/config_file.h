// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/CLI.hpp>

namespace holdfast::apps {

/// Adds --config FILE, which sets options and arguments of `command` not given on the command line,
/// and --print-config, which prints the current settings in the format of FILE and exits. This
/// format is described in docs/commands.md. Throws Error that names the file, line and key if the
/// file is invalid.
void AddConfigOptions(CLI::App& command);

}  // namespace holdfast::apps
