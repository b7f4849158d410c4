// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// Files of meshes/ that are part of the library, so that the program works from anywhere; and the
/// report's player, "player.html", where it was built.
struct EmbeddedFile {
  std::string_view name;  ///< path below meshes/, e.g. "objects/mug.ply"
  std::span<const std::byte> bytes;
};

/// All embedded files, sorted by name.
std::span<const EmbeddedFile> EmbeddedFiles();

/// One embedded file. Throws Error (listing what there is) when there is none of that name.
EmbeddedFile FindEmbedded(std::string_view name);

/// Whether there is one of that name.
bool HasEmbedded(std::string_view name);

/// Names (without folder and extension) of embedded files in a folder of meshes/ with an extension.
std::vector<std::string> EmbeddedNames(std::string_view folder, std::string_view extension);

}  // namespace holdfast
