// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <string_view>

#include <nlohmann/json.hpp>

namespace holdfast {

// manifest.json of a folder of synthetic clips: a head (schema, seed, options and finally a
// summary) and `clips`, with one line per attempted clip.

/// Lines by their "index".
using ManifestLines = std::map<int, nlohmann::json>;

/// Writes the whole manifest with one clip per line.
void WriteManifest(const std::filesystem::path& path, const nlohmann::json& head,
                   const ManifestLines& lines);

/// Returns the clips of an earlier run of `command` with the same `head`; only the hours may
/// differ. Returns none if there was no run, or if `replace` is set and the earlier run differs.
/// `made_from` ("captures") is named in the Error thrown if the manifest is of a different run.
ManifestLines LinesBefore(const std::filesystem::path& path, const nlohmann::json& head,
                          std::string_view command, std::string_view made_from, bool replace);

/// Removes clips that were written but whose "file" is no longer in `folder`.
void DropLost(ManifestLines& lines, const std::filesystem::path& folder);

}  // namespace holdfast
