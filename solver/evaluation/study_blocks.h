// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <nlohmann/json.hpp>

namespace holdfast {

/// Results of a long study, kept in files of some motions each, so that a stopped study goes on
/// where it was. Each file names the question that it answers, by a checksum.
class StudyBlocks {
 public:
  /// `folder` is made. With `replace`, blocks of another question count as none.
  StudyBlocks(std::filesystem::path folder, bool replace);

  /// Has `take` read the block's motions (a JSON list); false when there is no such block. Throws
  /// Error for a block of another question, and for one that `take` returns false for or throws
  /// nlohmann::json::exception at: it is damaged.
  bool Read(const std::string& name, int block, const std::string& question,
            const std::function<bool(const nlohmann::json& motions)>& take) const;

  /// Writes `out`, which has "motions", in one piece.
  void Write(const std::string& name, int block, const std::string& question,
             nlohmann::json out) const;

 private:
  std::filesystem::path File(const std::string& name, int block) const;

  std::filesystem::path folder_;
  bool replace_;
};

}  // namespace holdfast
