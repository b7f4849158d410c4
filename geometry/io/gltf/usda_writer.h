// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

struct UsdaOptions {
  std::string generator = "Holdfast";
  int every = 1;  ///< key frames: every n-th of the clip
  int threads = 1;
  std::function<void(int done, int total)> progress;  ///< called after each key frame; may be empty
};

/// Writes a clip as a USD text stage: z up, meters, time codes are the clip's frames. `/World/body`
/// is a mesh with `points` at each key frame (world coordinates, the body model's own surface),
/// `/World/object` (with an object track and `object` not null) a mesh with a transform at the same
/// frames. Coordinates have five decimals, a hundredth of a millimeter.
void WriteUsda(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
               const UsdaOptions& options, const std::filesystem::path& path);

}  // namespace holdfast
