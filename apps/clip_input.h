// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "generator/wandr/network.h"
#include "geometry/import/load_clip.h"
#include "geometry/report/report_page.h"

namespace holdfast::apps {

/// Accepted clip arguments, for help texts.
inline constexpr const char* kClipHelp =
    "Clip (.npz), result folder, embedded clip, or any file that 'holdfast import' reads";

/// Additional inputs of a clip, if given by the user.
struct ClipInputOptions {
  std::string body;           ///< body model file; empty: the embedded body
  std::string object;         ///< mesh or embedded object instead of the clip's own; optional
  double object_scale = 1.0;  ///< scale of that mesh
  /// Used instead of `body` when many clips are loaded: one body model for all of them.
  std::shared_ptr<const BodyModel> loaded_body = nullptr;
};

/// A clip given by the user, with accompanying data.
struct ClipInput : ReportInput {
  bool object_in_clip = false;              ///< the object mesh is stored in the clip file
  std::optional<TexturedMesh> object_look;  ///< appearance of such a mesh, if the file has it
  double object_scale = 1.0;                ///< scale of object_source
  std::optional<TriangleMesh> own_object;   ///< of the clip, if --object overrides it
};

/// Calls LoadClip and prints its notes. All commands load clips through this function.
LoadedClip LoadClip(const std::string& path_or_name, std::shared_ptr<const BodyModel> body,
                    const CommonOptions& common, ImportFileOptions import = {});

/// Warns if the clip states that a hand holds the object, but the hand is centimeters away.
void WarnIfAway(const std::string& source, const Clip& clip, const ClipBody& body,
                const TriangleMesh& object, const CommonOptions& common);

/// Loads a clip of any kind, as LoadClip does. The object mesh is the given one, or else that of
/// FindClipObject. If the clip names no object file and the object is not embedded, there is no
/// mesh, and `object_missing` states why. Throws Error if a given or named mesh, or the clip, is
/// unreadable.
ClipInput LoadClipInput(const std::string& path_or_name, const ClipInputOptions& options,
                        const CommonOptions& common);

/// Adds --body, --object and --object-scale.
void AddClipInputOptions(CLI::App& command, ClipInputOptions& options);

/// Calls LoadReachNetwork; warns if the network has to be retrained.
ReachNetwork LoadReachNetwork(const std::string& path, const CommonOptions& common);

/// Returns source, checksum, layout and notes.
nlohmann::json NetworkJson(const ReachNetwork& network);

/// Adds --weights, which is required if there are no embedded weights.
void AddWeightsOption(CLI::App& command, std::string& path);

}  // namespace holdfast::apps
