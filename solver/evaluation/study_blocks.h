// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <nlohmann/json.hpp>

namespace holdfast {

/// Has `take` read a block of a study, of the configuration asked for or not. False for one of
/// another configuration with `replace`. Throws Error for it without (`configuration`: what it is
/// made of), and for a block that `take` returns false for, or throws Error or
/// nlohmann::json::exception at: it is damaged.
bool TakeBlock(const std::filesystem::path& file, bool is_asked, bool replace,
               const char* configuration, const std::function<bool()>& take);

/// Where the wall times of a block are, so that the block has the same bytes in every run.
std::filesystem::path TimesFile(std::filesystem::path block);

/// Results of a long study, kept in files of some motions each, so that a stopped study goes on
/// where it was. Each file names the question that it answers, by a checksum.
class StudyBlocks {
 public:
  /// `folder` is made. With `replace`, blocks of another configuration count as none.
  StudyBlocks(std::filesystem::path folder, bool replace);

  /// Has `take` read the block's motions (a JSON list), as TakeBlock; false when there is none.
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
