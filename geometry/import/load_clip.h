// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <Eigen/Core>

#include "geometry/clip/clip_body.h"
#include "geometry/import/import_file.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A clip and the body that it animates.
struct LoadedClip : ImportedFile {
  std::filesystem::path file;  ///< path of the clip; empty for embedded clips and imported files
  bool imported = false;       ///< read by ImportFile, not from a clip file
  ClipBody body;
  std::optional<BodyChange> change;  ///< if the clip was made with another kind of model
};

/// Loads a clip of any kind: an embedded clip by name ("demo_drink"), a result folder (its
/// clip.npz), a clip file, or any other file that ImportFile reads. The body is
/// `options.parameters.body` (the embedded one if null) in the clip's shape; a clip made with
/// another kind of model is converted to it. `notes` reports the decisions made. Throws Error for
/// anything else.
LoadedClip LoadClip(const std::string& path_or_name, ImportFileOptions options = {});

/// Mesh of a clip's object: the one in the clip or its file, else the file that the clip names
/// (without substitute), else the embedded object that it names, else that of the object's name.
struct ClipObject {
  std::optional<TriangleMesh> mesh;  ///< full resolution, meters, times `scale`
  std::string source;                ///< where it comes from, for LoadObject with `scale`
  double scale = 1.0;                ///< the caller's, times that of a file not in meters
  bool in_clip = false;              ///< stored in the clip and nowhere else
  bool by_name = false;              ///< found only by the object's name
  std::string warning;               ///< if it replaces a mesh of another program
  std::string missing;               ///< why there is no mesh
};

/// Finds the mesh by track, file and import result; to have none is not an error (`missing`).
/// Throws Error for a file that is unreadable, has another checksum, or is missing from a result.
ClipObject FindClipObject(const LoadedClip& loaded, double scale = 1.0);

/// Median distance, millimeters, from hand to object over at most 40 of the frames in which the
/// clip marks the hand as holding, of the nearest hand vertex; 0 inside. nullopt for a clip without
/// labels or object. `object` is in its own frame.
std::optional<double> MeasureHeldDistance(const Clip& clip, const ClipBody& body,
                                          const TriangleMesh& object);

/// Warning that holding hands are more than a centimeter from the object, since another body than
/// the clip's has other limbs; `kHeldRemedy` belongs to it.
std::optional<std::string> WarnOfHeldDistance(const Clip& clip, const ClipBody& body,
                                              const TriangleMesh& object);
inline constexpr std::string_view kHeldRemedy =
    "give the body model that the clip was made with (--body MODEL.npz), or make a new grasp "
    "('holdfast fit CLIP OBJECT --regrasp')";

/// Reports how an imported clip changes on `model`, without changing it: a note if it was made with
/// another kind of model (else empty), and the warning above if its object is present.
std::pair<std::string, std::optional<std::string>> NotesOnBody(
    const Clip& clip, const std::shared_ptr<const BodyModel>& model, const TriangleMesh* object);

}  // namespace holdfast
