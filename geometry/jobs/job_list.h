// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <span>
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

/// Hashes what jobs ask: equal hashes, equal results. A word that names a file counts by its file
/// name and content, a folder by all that is in it, any other word as it is. Files that an input
/// names inside (the mesh beside a clip) are not seen. Thread-safe; keeps the checksums of the last
/// few thousand files.
class JobHasher {
 public:
  /// What all jobs have in common: a version, a command, options.
  explicit JobHasher(std::span<const std::string> common);

  /// 16 hexadecimal digits. Throws Error for a file that cannot be read.
  std::string Hash(std::span<const std::string> words);

 private:
  std::string Meaning(const std::string& word);

  std::mutex lock_;
  std::map<std::string, std::string> seen_;
  std::string common_;
};

}  // namespace holdfast
