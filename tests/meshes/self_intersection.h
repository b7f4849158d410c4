// SPDX-License-Identifier: MIT
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include "geometry/mesh/mesh.h"

namespace holdfast {

inline bool CutsItself(const TriangleMesh& mesh) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
  Surface surface;
  for (const auto& point : mesh.vertices.colwise()) {
    surface.add_vertex({point.x(), point.y(), point.z()});
  }
  for (const auto& face : mesh.faces.colwise()) {
    surface.add_face(Surface::Vertex_index(face[0]), Surface::Vertex_index(face[1]),
                     Surface::Vertex_index(face[2]));
  }
  return CGAL::Polygon_mesh_processing::does_self_intersect(surface);
}

}  // namespace holdfast
