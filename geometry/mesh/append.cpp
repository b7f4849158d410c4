// SPDX-License-Identifier: MIT
#include "geometry/mesh/append.h"

namespace holdfast {

void Append(const TriangleMesh& more, TriangleMesh& mesh) {
  const Eigen::Index vertices = mesh.NumVertices(), faces = mesh.NumFaces();
  mesh.vertices.conservativeResize(3, vertices + more.NumVertices());
  mesh.faces.conservativeResize(3, faces + more.NumFaces());
  mesh.vertices.rightCols(more.NumVertices()) = more.vertices;
  mesh.faces.rightCols(more.NumFaces()) = more.faces.array() + static_cast<int>(vertices);
}

}  // namespace holdfast
