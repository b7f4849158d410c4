// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace holdfast {

/// One job of a list.
struct JobLine {
  std::string where;               ///< file and line, for messages
  std::string name;                ///< of its result: no two of a list have the same
  std::vector<std::string> words;  ///< arguments; files as paths
  std::vector<std::pair<std::string, std::string>> keys;  ///< key=value
};

/// Reads a list of jobs: on each line
///
///   WORD... [key=value ...] [name=NAME]
///
/// Words and values that name a file beside the list become paths to it; quotes ("...") hold what
/// has spaces; # begins a comment. Names are made of the words' stems where left out, and numbered
/// where they would repeat: lines that are added at the end change no name above.
///
/// Throws Error with file and line for a quote that is not closed, a line without a word, a name
/// that is no file name or repeats; for a list without a job.
std::vector<JobLine> ReadJobList(const std::filesystem::path& path);

}  // namespace holdfast
