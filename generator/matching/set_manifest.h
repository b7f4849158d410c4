// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <string_view>

#include <nlohmann/json.hpp>

namespace holdfast {

// manifest.json of a folder of synthetic clips: a head (schema, seed, what was asked, in the end a
// summary), and `clips`: one line for each that was tried.

/// Lines by their "index".
using ManifestLines = std::map<int, nlohmann::json>;

/// Writes the whole manifest, one clip a line.
void WriteManifest(const std::filesystem::path& path, const nlohmann::json& head,
                   const ManifestLines& lines);

/// The clips of an earlier run of `command` that asked for the same: all that `head` has, only
/// hours may differ. None when there was no run, or with `replace` another one. `made_from`
/// ("captures") is named in the Error that a manifest of something else throws.
ManifestLines LinesBefore(const std::filesystem::path& path, const nlohmann::json& head,
                          std::string_view command, std::string_view made_from, bool replace);

/// Those that were made, and whose "file" is no longer in `folder`, are taken out.
void DropLost(ManifestLines& lines, const std::filesystem::path& folder);

}  // namespace holdfast
