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
  std::string source;             ///< as the user gave it
  TriangleMesh mesh;              ///< repaired if that is safe, scaled
  bool implausible_size = false;  ///< not a handheld object in meters
  std::vector<std::string> notes;
};

/// Names of the objects embedded in the library.
std::vector<std::string> EmbeddedObjectNames();

/// Loads a mesh by path, or an embedded object by name ("mug"). COLLADA scenes and the links of
/// URDF and MJCF files, with their joints at rest, become one mesh. `notes` lists the repairs and
/// the remaining faults. Throws Error listing the embedded names if it is neither.
LoadedObject LoadObject(const std::string& path_or_name, double scale = 1.0);

/// Same for a mesh that was already read; `source` names it in messages.
LoadedObject ObjectOfMesh(const TriangleMesh& mesh, std::string name, std::string source,
                          double scale = 1.0);

/// Throws Error for an object that is not of a size for a hand, with the scale that would help.
void RequireHandheld(const LoadedObject& object);

/// Mesh with `vertices` (300) vertices for the fit; the mesh itself if it has no more.
TriangleMesh ForFitting(const LoadedObject& object, int vertices, std::vector<std::string>* notes);

}  // namespace holdfast
