// SPDX-License-Identifier: MIT
#include "geometry/mesh/mesh.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/options.h"

namespace holdfast {

double SignedVolume(const TriangleMesh& mesh) {
  double six_volumes = 0.0;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const auto a = mesh.vertices.col(mesh.faces(0, f));
    const auto b = mesh.vertices.col(mesh.faces(1, f));
    const auto c = mesh.vertices.col(mesh.faces(2, f));
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6.0;
}

Eigen::Vector3d FaceCross(const TriangleMesh& mesh, Eigen::Index face) {
  const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, face));
  return (mesh.vertices.col(mesh.faces(1, face)) - a)
      .cross(mesh.vertices.col(mesh.faces(2, face)) - a);
}

double SurfaceArea(const TriangleMesh& mesh) {
  double area = 0.0;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) area += 0.5 * FaceCross(mesh, f).norm();
  return area;
}

Eigen::Matrix3Xd VertexNormals(const TriangleMesh& mesh) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, mesh.NumVertices());
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    Eigen::Matrix3d corner;
    for (int k = 0; k < 3; ++k) corner.col(k) = mesh.vertices.col(mesh.faces(k, f));
    const Eigen::Vector3d normal = FaceCross(mesh, f);
    const double length = normal.norm();
    if (!(length > 0.0)) continue;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d u = (corner.col((k + 1) % 3) - corner.col(k)).normalized();
      const Eigen::Vector3d v = (corner.col((k + 2) % 3) - corner.col(k)).normalized();
      const double angle = std::acos(std::clamp(u.dot(v), -1.0, 1.0));
      normals.col(mesh.faces(k, f)) += angle / length * normal;
    }
  }
  for (Eigen::Index v = 0; v < normals.cols(); ++v) {
    const double length = normals.col(v).norm();
    if (length > 0.0) normals.col(v) /= length;
  }
  return normals;
}

Eigen::Vector3d Extent(const TriangleMesh& mesh) {
  if (mesh.NumVertices() == 0) return Eigen::Vector3d::Zero();
  return mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
}

void RequireInRange(const TriangleMesh& mesh, std::string_view where) {
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (IsWithin(mesh.vertices(k, v), kMaxMeters)) continue;
      throw Error(where, fmt::format("vertex {} has the coordinate {:g}", v, mesh.vertices(k, v)),
                  "Coordinates must be within 100,000: remove the vertex, or scale the mesh");
    }
  }
}

void Append(const TriangleMesh& more, TriangleMesh& mesh) {
  const Eigen::Index vertices = mesh.NumVertices(), faces = mesh.NumFaces();
  mesh.vertices.conservativeResize(3, vertices + more.NumVertices());
  mesh.faces.conservativeResize(3, faces + more.NumFaces());
  mesh.vertices.rightCols(more.NumVertices()) = more.vertices;
  mesh.faces.rightCols(more.NumFaces()) = more.faces.array() + static_cast<int>(vertices);
}

}  // namespace holdfast
