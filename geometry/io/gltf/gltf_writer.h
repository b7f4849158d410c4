// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/mesh/textured_mesh.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

struct GlbOptions {
  std::string generator = "Holdfast";  ///< `asset.generator`
  std::string clip_name;               ///< of the animation, and in `asset.extras`
  bool correctives = true;             ///< pose correctives as morph targets
  double corrective_tolerance_m = 2e-5;
  int max_correctives = 128;
  int threads = 1;
  /// The object's own look in place of a plain one; may be null. Images are written as they are.
  const TexturedMesh* object_look = nullptr;
  /// What the object rests on, for a clip with a track of it; may be null.
  const TriangleMesh* table = nullptr;
};

struct GlbReport {
  int morph_targets = 0;
  int influences = 4;             ///< joints per vertex: 4, or 8 where 4 would not do
  double corrective_error_m = 0;  ///< largest distance from the body model's surface, metres
};

/// Writes a clip as a glTF 2.0 binary: the skinned and animated body of `surface` and, when the
/// clip has an object track and `object` is not null, the object that it carries.
///
/// Nodes: `body` shows the skin, with the 55 joints below it by their SMPL-X names, posed as in the
/// first frame (Blender makes an armature of it, with the mesh inside and no empties); beside it
/// the object and the table. z-up becomes glTF's y-up in the poses of these and of the pelvis. The
/// skin's inverse bind matrices are the T-pose's, which with the morph targets of a CorrectiveBasis
/// makes the file's surface the body model's within `corrective_error_m`. Morph weights lie in
/// [0, 1], which Blender would clamp them to. Single precision, nothing quantised; key frames at
/// the clip's frame rate, linear in between. Throws Error when the file would pass the format's
/// 4 GB or cannot be written.
GlbReport WriteGlb(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                   const GlbOptions& options, const std::filesystem::path& path);

}  // namespace holdfast
