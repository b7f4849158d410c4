// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/import/fields.h"
#include "geometry/import/import_motion.h"

namespace holdfast {

struct ImportFileOptions {
  ParameterOptions parameters;
  /// Of motions that are brought onto the body (BVH, ASF/AMC, glTF). Its frame rate is not used;
  /// without betas the shape is the file's, where it tells one of `parameters.body`.
  ImportOptions motion;
  /// Of the clip, Hz; 0 keeps the file's; empty: 30 for motions that are brought onto the body,
  /// the file's for parameters.
  std::optional<double> frame_rate;
};

/// What a file became.
struct ImportedFile : ImportedClip {
  int source_frames = 0;
  double source_frame_rate = 0;        ///< Hz
  std::optional<ImportReport> motion;  ///< of a motion that was brought onto the body
};

/// Reads any file of human motion that is known, format detected from the content, not from the
/// name. Throws Error for one that is malformed, and for one that is something else, naming what it
/// is where that can be told.
ImportedFile ImportFile(const std::filesystem::path& path, const ImportFileOptions& options);

/// The mesh that a clip's track names, relative to the clip; empty when there is none.
std::filesystem::path MeshBeside(const std::filesystem::path& clip,
                                 const std::optional<ObjectTrack>& track);

/// The mesh of an imported clip's object, meters; nothing where none was found or it cannot be
/// read.
std::optional<TriangleMesh> ObjectMeshOf(const ImportedClip& imported);

/// The formats, for help: "GRAB sequence (.npz)".
std::vector<std::string> ImportableFormats();

}  // namespace holdfast
