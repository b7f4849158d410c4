// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include <Eigen/Core>

/// Triangle meshes as plain data: they come in as loaded; checked, repaired, decimated and shaded
/// meshes, points on them, nearest points and signed distances come out.

namespace holdfast {

/// A triangle mesh as plain data: positions (3 x V, meters) and triangles (3 x F, vertex ids,
/// counter-clockwise seen from outside). Loaders guarantee ids in range and finite positions.
struct TriangleMesh {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi faces;

  Eigen::Index NumVertices() const { return vertices.cols(); }
  Eigen::Index NumFaces() const { return faces.cols(); }
};

/// Signed volume by the divergence theorem, cubic meters: positive when faces point outwards.
/// Meaningful for closed meshes only.
double SignedVolume(const TriangleMesh& mesh);

/// (b - a) x (c - a) of a face's corners: along its normal, as long as twice its area, m^2.
Eigen::Vector3d FaceCross(const TriangleMesh& mesh, Eigen::Index face);

/// Sum of the areas of the faces, m^2.
double SurfaceArea(const TriangleMesh& mesh);

/// Per-vertex unit normals (3 x V), face normals weighted by corner angle; zero where no face has
/// area.
Eigen::Matrix3Xd VertexNormals(const TriangleMesh& mesh);

/// Lengths of the axis-aligned bounding box, meters (zero for an empty mesh).
Eigen::Vector3d Extent(const TriangleMesh& mesh);

/// Throws Error (`where`, with the vertex) for the first coordinate that is outside the range of
/// geometry/value_ranges.h or no number.
void RequireInRange(const TriangleMesh& mesh, std::string_view where);

/// Adds the vertices and faces of another mesh, which may overlap this one: nothing is merged.
void Append(const TriangleMesh& more, TriangleMesh& mesh);

}  // namespace holdfast
