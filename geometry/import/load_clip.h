// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "geometry/clip/clip_body.h"
#include "geometry/import/import_file.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A clip and the body that it moves.
struct LoadedClip : ImportedFile {
  std::filesystem::path file;  ///< the clip's own; empty for an embedded clip and an imported file
  bool imported = false;       ///< read by ImportFile, not a clip yet
  ClipBody body;
  std::optional<BodyChange> change;  ///< where the clip was made with another kind of model
};

/// A clip of any kind: an embedded clip by name ("demo_drink"), a result folder (its clip.npz), a
/// clip's file, or whatever else ImportFile reads. The body is `options.parameters.body` (the
/// embedded one when null) in the clip's shape; a clip that was made with a model of another kind
/// is brought onto it. `notes` says what was decided on the way. Throws Error for what is none of
/// these.
LoadedClip LoadClip(const std::string& path_or_name, ImportFileOptions options = {});

/// The mesh of a clip's object: the one that the clip carries or its file holds, else the file that
/// it names and no other, else the embedded object that it names, else that of the object's name.
struct ClipObject {
  std::optional<TriangleMesh> mesh;  ///< full resolution, meters, times `scale`
  std::string source;                ///< where it is from, for LoadObject with `scale`
  double scale = 1.0;                ///< the caller's, and of a file that is not in meters
  bool in_clip = false;              ///< the clip's own, at no other place
  bool by_name = false;              ///< known by the object's name alone
  std::string warning;               ///< where that stands in for a mesh of another program's
  std::string missing;               ///< why there is none
};

/// An object without a mesh is no fault (`missing`). Looks at the track, the file, what an importer
/// found. Throws Error for a file that is unreadable, of another checksum, missing from a result.
ClipObject FindClipObject(const LoadedClip& loaded, double scale = 1.0);

/// How far a hand is from the object in the frames in which the clip says that it holds it.
struct HeldDistance {
  int frames = 0;          ///< with a hand that holds
  double median_mm = 0.0;  ///< over (at most 40 of) them, of the nearest vertex; 0 inside
};

/// Nothing for a clip without labels or object. `object` is in its own frame.
std::optional<HeldDistance> MeasureHeldDistance(const Clip& clip, const ClipBody& body,
                                                const TriangleMesh& object);

/// Of hands that are said to hold and are more than a centimeter away: another body than the clip's
/// has other limbs.
struct HeldWarning {
  std::string seen, advice;
};
std::optional<HeldWarning> WarnOfHeldDistance(const Clip& clip, const ClipBody& body,
                                              const TriangleMesh& object);

/// What becomes of a clip as it was imported on `model`, without changing it: a note where it was
/// made with another kind of model (else empty), and the warning above where its object is there.
struct BodyNotes {
  std::string change;
  std::optional<HeldWarning> held;
};
BodyNotes NotesOnBody(const Clip& clip, const std::shared_ptr<const BodyModel>& model,
                      const TriangleMesh* object);

}  // namespace holdfast
