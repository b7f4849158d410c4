// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <mutex>
#include <span>
#include <string>

namespace holdfast {

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
