// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "geometry/import/file_kind.h"

namespace holdfast {

/// One known fact about a file: for programs under `name` (which includes the unit), for people as
/// `text`.
struct Fact {
  std::string name;
  std::variant<double, std::string, std::vector<double>> value;
  std::string text;
};

enum class Verdict {
  kOk,       ///< checked and correct
  kWarning,  ///< usable, with a caveat
  kFault,    ///< not usable as it is
};

struct Finding {
  Verdict verdict = Verdict::kOk;
  std::string text;  ///< what was observed
  std::string fix;   ///< what to do; empty if there is nothing to do
};

/// What a file is, whether it is valid, and what to do with it.
struct Inspection {
  std::filesystem::path path;
  Identity identity;
  std::string title;  ///< one line: "SMPL-X motion with an object (.npz)"
  std::vector<Fact> facts;
  std::vector<Finding> findings;
  std::vector<std::string> next;  ///< suggested commands, ready to type

  void AddFact(std::string name, double value, std::string text);
  void AddFact(std::string name, std::string value, std::string text);
  void AddFact(std::string name, std::vector<double> value, std::string text);
  void Ok(std::string text);
  void Warn(std::string text, std::string fix);
  void Fault(std::string text, std::string fix);

  Verdict Worst() const;  ///< worst verdict of all findings
};

/// Inspects a file or a result folder with its files. Every fault of a file becomes a finding:
/// throws nothing for any content, except std::bad_alloc if memory runs out.
Inspection Inspect(const std::filesystem::path& path);

/// Returns a path as a word of a shell command, quoted if necessary.
std::string ShellWord(const std::filesystem::path& path);

/// Returns "walk" for "walk.bvh.gz": the stem for names of results in suggested commands.
std::string Stem(const std::filesystem::path& path);

}  // namespace holdfast
