// SPDX-License-Identifier: MIT
#include "meshes/make/objects/mesh_faults.h"

#include <utility>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

namespace holdfast {

std::vector<Eigen::Vector3d> FindSelfIntersections(const TriangleMesh& mesh) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
  Mesh surface;
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
    surface.add_vertex({mesh.vertices(0, v), mesh.vertices(1, v), mesh.vertices(2, v)});
  }
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    surface.add_face(Mesh::Vertex_index(mesh.faces(0, f)), Mesh::Vertex_index(mesh.faces(1, f)),
                     Mesh::Vertex_index(mesh.faces(2, f)));
  }
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
  CGAL::Polygon_mesh_processing::self_intersections(surface, std::back_inserter(pairs));
  std::vector<Eigen::Vector3d> places;
  for (const auto& [face, other] : pairs) {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const auto v : surface.vertices_around_face(surface.halfedge(face))) {
      center += mesh.vertices.col(static_cast<Eigen::Index>(v)) / 3.0;
    }
    places.push_back(center);
  }
  return places;
}

}  // namespace holdfast
