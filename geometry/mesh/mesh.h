// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include <Eigen/Core>

/// Triangle meshes as plain data. From loaded meshes, the headers of this folder compute checked,
/// repaired, decimated and shaded meshes, surface samples, nearest points and signed distances.

namespace holdfast {

/// A triangle mesh as plain data: positions (3 x V, meters) and triangles (3 x F, vertex ids,
/// counter-clockwise seen from outside). Loaders guarantee ids in range and finite positions.
struct TriangleMesh {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi faces;

  Eigen::Index NumVertices() const { return vertices.cols(); }
  Eigen::Index NumFaces() const { return faces.cols(); }
};

/// Signed volume by the divergence theorem, cubic meters; positive if the faces point outwards.
/// Only meaningful for closed meshes.
double SignedVolume(const TriangleMesh& mesh);

/// Returns (b - a) x (c - a) of a face's corners: along its normal, length twice its area, m^2.
Eigen::Vector3d FaceCross(const TriangleMesh& mesh, Eigen::Index face);

/// Sum of the face areas, m^2.
double SurfaceArea(const TriangleMesh& mesh);

/// Per-vertex unit normals (3 x V): face normals weighted by corner angle; zero where all adjacent
/// faces have no area.
Eigen::Matrix3Xd VertexNormals(const TriangleMesh& mesh);

/// Side lengths of the axis-aligned bounding box, meters (zero for an empty mesh).
Eigen::Vector3d Extent(const TriangleMesh& mesh);

/// Throws Error (`where`, with the vertex) for the first coordinate that is not finite or outside
/// the range of geometry/options.h.
void RequireInRange(const TriangleMesh& mesh, std::string_view where);

/// Appends the vertices and faces of another mesh. The meshes may overlap; nothing is merged.
void Append(const TriangleMesh& more, TriangleMesh& mesh);

}  // namespace holdfast
