// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/import/fields.h"
#include "geometry/import/import_motion.h"
#include "geometry/options.h"

namespace holdfast {

struct ImportFileOptions {
  ParameterOptions parameters;
  /// For motions that are retargeted to the body (BVH, ASF/AMC, glTF). Its frame rate and facts are
  /// not used, but those above and below.
  /// Without betas, the shape is the file's if the file has one for `parameters.body`.
  ImportOptions motion;
  /// Frame rate of the clip, Hz. 0 keeps the file's; empty: 30 for retargeted motions, the file's
  /// for parameters.
  std::optional<double> frame_rate;
};

/// Options of `import`.
OptionTable OptionsOf(ImportFileOptions& options);

/// Result of importing a file.
struct ImportedFile : ImportedClip {
  int source_frames = 0;
  double source_frame_rate = 0;        ///< Hz
  std::optional<ImportReport> motion;  ///< of a retargeted motion
};

/// Reads any known file of human motion; the format is detected from the content, not from the
/// name. Throws Error for a malformed file, and for any other file, naming its kind if known.
ImportedFile ImportFile(const std::filesystem::path& path, const ImportFileOptions& options);

/// Path of the mesh that a clip's track names, relative to the clip; empty if there is none.
std::filesystem::path MeshBeside(const std::filesystem::path& clip,
                                 const std::optional<ObjectTrack>& track);

/// Mesh of an imported clip's object, meters; nullopt if none was found or it cannot be read.
std::optional<TriangleMesh> ObjectMeshOf(const ImportedClip& imported);

/// Importable formats for help texts: "GRAB sequence (.npz)".
std::vector<std::string> ImportableFormats();

}  // namespace holdfast
