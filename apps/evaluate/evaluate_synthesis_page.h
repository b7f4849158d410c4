// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/evaluation/synthesis/synthesis_results.h"

namespace holdfast::apps {

/// A table as text, for Markdown and HTML alike.
struct TextTable {
  std::string title, about;
  std::vector<std::string> heads;
  std::vector<std::vector<std::string>> rows;
  std::vector<int> strong;  ///< rows to be seen first
};

/// A line per network, for the terminal: wall times of one core, medians over sequences.
std::string SynthesisTimes(std::span<const SynthesisResult> results);

/// Table 2 by either definition for each way to place objects, objects and motion, and what the
/// paper has. `modes` are those that were run.
std::vector<TextTable> SynthesisTables(std::span<const SynthesisResult> results,
                                       std::span<const ObjectMode> modes);

std::string SynthesisMarkdown(const std::vector<TextTable>& tables,
                              std::span<const SynthesisResult> results,
                              std::span<const ObjectMode> modes);
/// One page without scripts: notes, tables, accuracy by action.
std::string SynthesisPage(const std::vector<std::string>& notes,
                          const std::vector<TextTable>& tables,
                          std::span<const SynthesisResult> results,
                          std::span<const ObjectMode> modes);

}  // namespace holdfast::apps
