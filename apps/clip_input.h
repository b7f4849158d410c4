// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/common.h"
#include "geometry/import/load_clip.h"
#include "geometry/report/report_facts.h"

namespace holdfast::apps {

/// What a command takes for a clip, in its help.
inline constexpr const char* kClipHelp =
    "Clip (.npz), result folder, embedded clip, or any file that 'holdfast import' reads";

/// What a clip needs besides itself, where the user states it.
struct ClipInputOptions {
  std::string body;    ///< body model file; empty: the embedded body
  std::string object;  ///< mesh or embedded object in place of the one the clip names; may be empty
  double object_scale = 1.0;  ///< of that mesh
  /// In place of `body`, where many clips are loaded: one body model for all of them.
  std::shared_ptr<const BodyModel> loaded_body = nullptr;
};

/// A clip as the user named it, with what lies beside it.
struct ClipInput : ReportInput {
  bool object_in_clip = false;              ///< the clip's own file holds the object's mesh
  std::optional<TexturedMesh> object_look;  ///< of such a mesh, where the file gives one
  double object_scale = 1.0;                ///< of object_source
  std::optional<TriangleMesh> own_object;   ///< that the clip names or holds, where one was told
};

/// LoadClip with its notes told: every command loads its clips through here.
LoadedClip LoadClip(const std::string& path_or_name, std::shared_ptr<const BodyModel> body,
                    const CommonOptions& common, ImportFileOptions import = {});

/// Warns where the clip says that a hand holds the object, and the hand is centimeters away.
void WarnIfAway(const std::string& source, const Clip& clip, const ClipBody& body,
                const TriangleMesh& object, const CommonOptions& common);

/// Loads a clip of any kind, as LoadClip does. The object's mesh is the one told, else that of
/// FindClipObject. A clip that names no file of its object has none where the object is not
/// embedded either (`object_missing` says why); one that was told or is named and cannot be read
/// throws Error, as does an unreadable clip.
ClipInput LoadClipInput(const std::string& path_or_name, const ClipInputOptions& options,
                        const CommonOptions& common);

/// Adds --body, --object and --object-scale.
void AddClipInputOptions(CLI::App& command, ClipInputOptions& options);

}  // namespace holdfast::apps
