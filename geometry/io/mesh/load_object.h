// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "geometry/error.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// An object ready for fitting.
struct LoadedObject {
  std::string name;               ///< stem of the file, or the embedded object's name
  std::string source;             ///< as the user wrote it
  TriangleMesh mesh;              ///< repaired where that is safe, scaled
  bool implausible_size = false;  ///< not a handheld object in meters
  double suggested_scale = 1.0;   ///< then, the factor that would make it one, if there is one
  std::vector<std::string> notes;
};

/// Names of the objects that are part of the library.
std::vector<std::string> EmbeddedObjectNames();

/// A mesh by path, or an embedded object by name ("mug"). What was repaired, and what is wrong and
/// could not be, is in `notes`. Throws Error listing the embedded names when it is neither.
LoadedObject LoadObject(const std::string& path_or_name, double scale = 1.0);

/// The same for a mesh that was read already (of `source`, which messages name).
LoadedObject ObjectOfMesh(const TriangleMesh& mesh, std::string name, std::string source,
                          double scale = 1.0);

/// Throws Error for an object that is not a size for a hand, with the scale that would help.
void RequireHandheld(const LoadedObject& object);

/// 300 (or `vertices`) vertices for the fit: the mesh itself when it has no more.
TriangleMesh ForFitting(const LoadedObject& object, int vertices, std::vector<std::string>* notes);

}  // namespace holdfast
