// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "geometry/import/file_kind.h"

namespace holdfast {

/// One thing that is known of a file: for programs under `name` (units in the name), for people as
/// `text`.
struct Fact {
  std::string name;
  std::variant<double, std::string, std::vector<double>> value;
  std::string text;
};

enum class Verdict {
  kOk,       ///< looked at, and right
  kWarning,  ///< usable; know this first
  kFault,    ///< not usable as it is
};

struct Finding {
  Verdict verdict = Verdict::kOk;
  std::string text;  ///< what was seen
  std::string fix;   ///< what to do; empty when there is nothing to
};

/// What one file is, whether it is sound, and what to do with it.
struct Inspection {
  std::filesystem::path path;
  Identity identity;
  std::string title;  ///< one line: "SMPL-X motion with an object (.npz)"
  std::vector<Fact> facts;
  std::vector<Finding> findings;
  std::vector<std::string> next;  ///< commands to type, literally

  void AddFact(std::string name, double value, std::string text);
  void AddFact(std::string name, std::string value, std::string text);
  void AddFact(std::string name, std::vector<double> value, std::string text);
  void Ok(std::string text);
  void Warn(std::string text, std::string fix);
  void Fault(std::string text, std::string fix);

  Verdict Worst() const;  ///< of the findings
};

/// Looks at a file and, in a result folder, at what belongs to it. Every fault of the file is a
/// finding: throws nothing for any content, only std::bad_alloc where memory ends.
Inspection Inspect(const std::filesystem::path& path);

/// A path as a word of a shell command: in quotes where it has to be.
std::string ShellWord(const std::filesystem::path& path);

/// "walk.bvh.gz" to "walk": for the names of results in suggested commands.
std::string Stem(const std::filesystem::path& path);

}  // namespace holdfast
