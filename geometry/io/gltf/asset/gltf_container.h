// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace holdfast {

inline constexpr std::string_view kFetchAgain = "Fetch or export the file again";

/// The two parts of a glTF file: its JSON text, and the binary chunk of a .glb (empty for .gltf and
/// for a .glb without one). Views into the file's bytes.
struct GltfContainer {
  std::string_view json;
  std::string_view binary;
};

/// Whether a file that begins with these bytes is glTF 2.0: the magic of a .glb, or a JSON object
/// that names parts that only glTF has.
bool LooksLikeGltf(std::string_view head);

/// Takes a .glb or a .gltf apart. `where` names the file in messages. Throws Error for a .glb of
/// another version, one that is cut short and chunks that pass its end.
GltfContainer SplitGltf(std::string_view bytes, const std::string& where);

/// The file that a buffer's `uri` names, which lies in `folder` or below it; empty for a `data:`
/// text. Throws Error, nothing having been opened, for network addresses, absolute paths, "..",
/// links that lead out of the folder, and files that are not there.
std::filesystem::path ResolveGltfUri(std::string_view uri, const std::filesystem::path& folder,
                                     const std::string& where);

/// The bytes of a `data:...;base64,` text. Throws Error for other encodings.
std::string DecodeDataUri(std::string_view uri, const std::string& where);

}  // namespace holdfast
