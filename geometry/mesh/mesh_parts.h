// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Throws Error for vertex ids out of range and coordinates that are not finite.
void RequireValid(const TriangleMesh& mesh);

/// Whether the corners of a face are collinear up to rounding: its height is below 1e-10 of its
/// longest side.
bool HasNoArea(const TriangleMesh& mesh, Eigen::Index face);

/// Returns for each vertex the first vertex at exactly the same position.
std::vector<int> FirstAtSamePlace(const Eigen::Matrix3Xd& vertices);

/// Gives each fan of faces at a vertex (faces joined through edges at that vertex) a vertex of its
/// own, so that surfaces that touch only in a vertex are separated. Copies are appended to the
/// vertices. Returns the number of copies. No face may have a repeated corner.
Eigen::Index PartTouchingFans(TriangleMesh& mesh);

inline void FlipFace(Eigen::Matrix3Xi& faces, Eigen::Index face) {
  std::swap(faces(1, face), faces(2, face));
}

/// Orients faces consistently across edges of two faces, keeping the majority orientation of each
/// patch. Returns the number of flipped faces.
Eigen::Index OrientConsistently(TriangleMesh& mesh);

/// Drops vertices without faces.
void DropUnreferenced(TriangleMesh& mesh);

/// Makes a surface with boundary manifold and orientable: sheets that meet in an edge get separate
/// vertices. At an edge of three or more faces, faces are paired: first those of one patch (faces
/// joined through edges of two faces), then those of the same orientation, then the straightest. A
/// fin is thereby detached and the surface below it stays whole; CGAL's
/// duplicate_non_manifold_edges_in_polygon_soup would slit it along the fin. No position changes.
/// No face may have a repeated corner; `mesh` is oriented as by OrientConsistently. Returns the
/// changes in plain sentences; empty if there were none.
std::vector<std::string> PartSheets(TriangleMesh& mesh);

/// A part of a mesh: faces joined through shared edges.
struct MeshPart {
  int first_face = -1;
  bool closed = true;      ///< every edge has two faces
  bool consistent = true;  ///< the two faces of every edge traverse it in opposite directions
  double volume_m3 = 0.0;  ///< signed
  Eigen::Vector3d min, max;
  /// Closed and consistent parts that enclose this part, if it is closed and consistent itself.
  std::vector<int> enclosed_by;
};

struct MeshParts {
  std::vector<int> part_of_face;  ///< -1 for a face with a repeated corner
  std::vector<MeshPart> parts;    ///< ordered by first face
};

MeshParts FindParts(const TriangleMesh& mesh);

}  // namespace holdfast
