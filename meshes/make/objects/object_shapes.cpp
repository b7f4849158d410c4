// SPDX-License-Identifier: MIT
#include "meshes/make/objects/object_shapes.h"

#include <algorithm>

namespace holdfast {

std::vector<HandheldObject> HandheldObjects() {
  std::vector<HandheldObject> all;
  for (const auto& group : {SimpleObjects(), TablewareObjects(), ToolObjects(), DeviceObjects()}) {
    all.insert(all.end(), group.begin(), group.end());
  }
  std::sort(all.begin(), all.end(),
            [](const HandheldObject& a, const HandheldObject& b) { return a.name < b.name; });
  return all;
}

TriangleMesh PlaceOnTable(TriangleMesh mesh_mm) {
  const Eigen::Vector3d low = mesh_mm.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = mesh_mm.vertices.rowwise().maxCoeff();
  const Eigen::Vector3d origin(0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), low.z());
  const Eigen::Matrix3Xd placed = 1e-3 * (mesh_mm.vertices.colwise() - origin);
  mesh_mm.vertices = placed.cast<float>().cast<double>();
  return mesh_mm;
}

}  // namespace holdfast
