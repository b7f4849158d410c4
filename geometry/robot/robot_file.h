// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace holdfast {

/// An XML tag. No tree is built, so nesting depth is unlimited.
struct XmlTag {
  bool closes = false, empty = false;  ///< `</a>`, `<a/>`
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< references resolved
  std::size_t begin = 0, end = 0;                               ///< range of the tag in the text

  /// Returns the value of an attribute; empty if there is none of that name.
  std::string_view Attribute(std::string_view name) const;
};

/// Iterates over tags. Skips comments, CDATA, declarations and processing instructions.
class XmlTags {
 public:
  explicit XmlTags(std::string_view text) : text_(text) {}
  /// Advances to the next tag. Returns false at the end of the text and at an unterminated tag.
  bool Next(XmlTag& tag);
  bool DefinesEntities() const { return defines_entities_; }  ///< in the text read so far

 private:
  bool Skip(std::string_view after);
  bool ReadAttributes(XmlTag& tag);

  std::string_view text_;
  std::size_t at_ = 0;
  bool defines_entities_ = false;
};

/// Contents of a robot file that are checked before a library reads it.
struct RobotFile {
  std::string text;  ///< contents of the file
  /// Referenced files: the name as written, and the resolved path. The path is empty if the file is
  /// missing or the name starts with package://.
  std::vector<std::pair<std::string, std::filesystem::path>> files;
};

/// Reads a robot file and its includes far enough to decide whether a library may parse them.
/// Throws Error, naming the file, if it or a file it references is not a regular file (a pipe,
/// device or folder); if it is empty or larger than 64 MB, nested deeper than 200 elements, or has
/// more elements or links than any robot; if a number is not finite; if counts and sizes
/// (composites, height fields, textures, user data) would make the library allocate gigabytes; or
/// if it defines its own entities.
RobotFile CheckRobotFile(const std::filesystem::path& path);

}  // namespace holdfast
