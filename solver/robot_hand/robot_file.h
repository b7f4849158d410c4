// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace holdfast {

/// A tag of an XML text. Nothing is built of it, so that no text is too deep.
struct XmlTag {
  enum class Kind { kOpens, kCloses, kEmpty };  ///< `<a>`, `</a>`, `<a/>`
  Kind kind = Kind::kOpens;
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< character references resolved
  std::size_t begin = 0, end = 0;                               ///< of its text

  /// Empty where there is none of that name.
  std::string_view Attribute(std::string_view name) const;
};

/// Goes through the tags of a text; comments, CDATA, declarations and instructions are passed over.
class XmlTags {
 public:
  explicit XmlTags(std::string_view text) : text_(text) {}
  /// False at the end, and where a tag does not end.
  bool Next(XmlTag& tag);
  bool DefinesEntities() const { return defines_entities_; }  ///< so far

 private:
  bool Skip(std::string_view after);
  bool ReadAttributes(XmlTag& tag);

  std::string_view text_;
  std::size_t at_ = 0;
  bool defines_entities_ = false;
};

/// What is known of a robot's file before a library reads it.
struct RobotFile {
  std::string text;  ///< of the file itself
  std::string root;  ///< its first element: "robot", "mujoco"
  /// Files that it names: as it does, and where that is; empty where there is none, and for
  /// package://.
  std::vector<std::pair<std::string, std::filesystem::path>> files;
};

/// Reads a robot's file and the files that it includes as far as it takes to know that a library
/// may be given them. Throws Error, which names the file, for one that is no regular file (nor is
/// what it names: a pipe, a device, a folder), that is empty or larger than 64 MB, nested deeper
/// than 200 elements, with more elements or links than any robot, with a number that is not finite,
/// with counts and sizes (composites, height fields, textures, user data) of which the library
/// would make gigabytes, or with entities of its own.
RobotFile CheckRobotFile(const std::filesystem::path& path);

}  // namespace holdfast
