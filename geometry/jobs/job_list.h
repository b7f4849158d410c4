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
  std::string where;                                      ///< file and line, for messages
  std::string name;                                       ///< name of the result; unique in a list
  std::vector<std::string> words;                         ///< arguments; files as paths
  std::vector<std::pair<std::string, std::string>> keys;  ///< key=value
};

/// Reads a list of jobs, one per line:
///
///   WORD... [key=value ...] [name=NAME]
///
/// Words and values that name a file next to the list become paths to that file. Double quotes
/// enclose text with spaces; # starts a comment. Without name=, the name is built from the stems of
/// the words and numbered if it would repeat: lines appended to the list change no earlier name.
///
/// Throws Error with file and line for an unclosed quote, a line without a word, and a name that
/// repeats or is not a file name. Throws Error for a list without a job.
std::vector<JobLine> ReadJobList(const std::filesystem::path& path);

/// Hashes the inputs of jobs: equal hashes mean equal results. A word that names a file counts with
/// its file name and content, a folder with all its files that are not hidden, any other word as it
/// is. Files that an input refers to (the mesh of a clip) are not included. Thread-safe; caches the
/// checksums of the last few thousand files.
class JobHasher {
 public:
  /// `common` holds what all jobs share: version, command, options.
  explicit JobHasher(std::span<const std::string> common);

  /// Returns 16 hexadecimal digits. Throws Error for a file that cannot be read.
  std::string Hash(std::span<const std::string> words);

 private:
  std::string Meaning(const std::string& word);

  std::mutex lock_;
  std::map<std::string, std::string> seen_;
  std::string common_;
};

}  // namespace holdfast
