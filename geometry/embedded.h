// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// Files of meshes/ that are part of the library, so that the program does not depend on its
/// location; also the report's player, "player.html" and "contacts.html", if it was built.
struct EmbeddedFile {
  std::string_view name;  ///< path below meshes/, e.g. "objects/mug.ply"
  std::span<const std::byte> bytes;
};

/// Returns all embedded files, sorted by name.
std::span<const EmbeddedFile> EmbeddedFiles();

/// Returns one embedded file. Throws Error, listing the names, if it does not exist.
EmbeddedFile FindEmbedded(std::string_view name);

/// Whether a file of that name exists.
bool HasEmbedded(std::string_view name);

/// Names (without folder and extension) of embedded files in a folder of meshes/ with an extension.
std::vector<std::string> EmbeddedNames(std::string_view folder, std::string_view extension);

}  // namespace holdfast
