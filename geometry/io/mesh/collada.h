// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Whether the path ends in .dae, in any case.
bool IsCollada(const std::filesystem::path& path);

/// Reads a COLLADA file with assimp: the triangles of its scene as one mesh, in meters (by the
/// file's unit), along the file's own axes whatever its up_axis, as ROS reads them. Throws Error
/// for a file that assimp refuses or that has no triangle, and if this build has no assimp.
///
/// assimp is not made for hostile files: call this in a process of its own (ReadInProcess).
TriangleMesh ReadCollada(const std::filesystem::path& path);

}  // namespace holdfast
