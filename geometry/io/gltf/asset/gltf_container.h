// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace holdfast {

/// The two parts of a glTF file: its JSON text, and the binary chunk of a .glb (empty for .gltf and
/// for a .glb without one). Views into the file's bytes.
struct GltfContainer {
  std::string_view json;
  std::string_view binary;
};

/// Whether a file that begins with these bytes is glTF 2.0: the magic number of a .glb, or a JSON
/// object with names that only glTF has.
bool LooksLikeGltf(std::string_view head);

/// Splits a .glb or a .gltf. `where` names the file in messages. Throws Error for a .glb of another
/// version, a truncated one, and chunks that extend beyond its end.
GltfContainer SplitGltf(std::string_view bytes, const std::string& where);

/// Returns the file that a buffer's `uri` names, in `folder` or below it; empty for a `data:` text.
/// Throws Error, without opening anything, for network addresses, absolute paths, "..", links that
/// lead out of the folder, and missing files.
std::filesystem::path ResolveGltfUri(std::string_view uri, const std::filesystem::path& folder,
                                     const std::string& where);

/// Returns the bytes of a `data:...;base64,` text. Throws Error for other encodings.
std::string DecodeDataUri(std::string_view uri, const std::string& where);

}  // namespace holdfast
