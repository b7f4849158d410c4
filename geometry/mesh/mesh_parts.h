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

inline void FlipFace(Eigen::Matrix3Xi& faces, Eigen::Index face) {
  std::swap(faces(1, face), faces(2, face));
}

/// Makes faces agree across edges of two faces, the larger share of each patch keeping its way
/// round; returns how many were flipped.
Eigen::Index OrientConsistently(TriangleMesh& mesh);

/// Drops vertices of no face; returns the ids of those that stay.
std::vector<int> DropUnreferenced(TriangleMesh& mesh);

struct PartedSheets {
  Eigen::Index edges = 0;      ///< of three faces or more, at which sheets came apart
  Eigen::Index one_sided = 0;  ///< edges along which a surface without two sides was cut
};

/// Makes a surface with boundary manifold and orientable by vertices of their own for sheets that
/// meet in an edge. At an edge of three faces or more, faces go on in pairs: first those of one
/// patch (faces joined through edges of two), then those that agree in orientation, then the
/// straightest. A fin comes off that way and leaves the surface below it whole, which CGAL's
/// duplicate_non_manifold_edges_in_polygon_soup slits open along the fin. No place changes. No face
/// may have a repeated corner; `mesh` is oriented as OrientConsistently leaves it.
PartedSheets PartSheets(TriangleMesh& mesh);

/// What was done, as plain sentences; none where nothing was.
std::vector<std::string> Describe(const PartedSheets& parted);

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
