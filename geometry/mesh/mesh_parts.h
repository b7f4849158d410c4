// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Throws Error for vertex ids out of range and coordinates that are not finite.
void RequireValid(const TriangleMesh& mesh);

/// Whether the corners of a face lie on one line, or would after rounding: its height is below
/// 1e-10 of its longest side.
bool HasNoArea(const TriangleMesh& mesh, Eigen::Index face);

/// Per vertex, the first vertex at exactly the same place.
std::vector<int> FirstAtSamePlace(const Eigen::Matrix3Xd& vertices);
Eigen::Index CountDuplicateVertices(const Eigen::Matrix3Xd& vertices);

/// Per face, whether an earlier one has the same three corners in any order.
std::vector<bool> DuplicateFaces(const Eigen::Matrix3Xi& faces);
Eigen::Index CountDuplicateFaces(const Eigen::Matrix3Xi& faces);

/// Gives each fan of faces at a vertex (faces joined through edges at it) a vertex of its own, so
/// that surfaces that touch in a vertex come apart. Copies are added behind the vertices; returns
/// how many. No face may have a repeated corner.
Eigen::Index PartTouchingFans(TriangleMesh& mesh);

/// A part of a mesh: faces joined through shared edges.
struct MeshPart {
  Eigen::Index num_faces = 0;
  int first_face = -1;
  bool closed = true;      ///< every edge has two faces
  bool consistent = true;  ///< the two faces of every edge run through it in opposite ways
  double volume_m3 = 0.0;  ///< signed
  Eigen::Vector3d min, max;
  /// The closed and consistent parts around this one, if it is such a part itself.
  std::vector<int> enclosed_by;
};

struct MeshParts {
  std::vector<int> part_of_face;  ///< -1 for a face with a repeated corner
  std::vector<MeshPart> parts;    ///< by first face
};

MeshParts FindParts(const TriangleMesh& mesh);

}  // namespace holdfast
