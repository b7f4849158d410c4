// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A clip in a mirror at x = 0, its object and table too, each mirrored at x = 0 of its own frame:
/// of a body that is symmetric, with the object's mesh mirrored, the very same scene. `root` is the
/// pelvis J_0 of the body at rest (metres), about which poses turn.
Clip MirrorClip(const Clip& clip, const Eigen::Vector3d& root);

/// A mesh mirrored at x = 0, its faces outwards still.
TriangleMesh MirrorMesh(TriangleMesh mesh);

}  // namespace holdfast
