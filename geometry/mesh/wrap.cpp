// SPDX-License-Identifier: MIT
#include "geometry/mesh/wrap.h"

#include <array>
#include <vector>

#include "geometry/error.h"
#include "geometry/mesh/mesh_parts.h"

#ifndef HOLDFAST_WITHOUT_GPL

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

namespace holdfast {
namespace {

// Alpha wrapping is a Delaunay refinement: its predicates must be exact.
using FilteredKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using FilteredPoint = FilteredKernel::Point_3;

}  // namespace

TriangleMesh WrapSurface(const TriangleMesh& mesh, double alpha_m, double offset_m) {
  RequireValid(mesh);
  std::vector<FilteredPoint> points;
  points.reserve(mesh.NumVertices());
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
    points.emplace_back(mesh.vertices(0, v), mesh.vertices(1, v), mesh.vertices(2, v));
  }
  std::vector<std::array<std::size_t, 3>> triangles;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    if (HasNoArea(mesh, f)) continue;
    triangles.push_back({static_cast<std::size_t>(mesh.faces(0, f)),
                         static_cast<std::size_t>(mesh.faces(1, f)),
                         static_cast<std::size_t>(mesh.faces(2, f))});
  }
  if (triangles.empty()) throw Error("mesh", "has no face with an area", "Give a surface");

  CGAL::Surface_mesh<FilteredPoint> wrap;
  CGAL::alpha_wrap_3(points, triangles, alpha_m, offset_m, wrap);
  wrap.collect_garbage();

  TriangleMesh out;
  out.vertices.resize(3, wrap.number_of_vertices());
  out.faces.resize(3, wrap.number_of_faces());
  for (const auto v : wrap.vertices()) {
    const FilteredPoint& p = wrap.point(v);
    out.vertices.col(v.idx()) << p.x(), p.y(), p.z();
  }
  for (const auto f : wrap.faces()) {
    int k = 0;
    for (const auto v : wrap.vertices_around_face(wrap.halfedge(f))) {
      out.faces(k++, f.idx()) = static_cast<int>(v.idx());
    }
  }
  return out;
}

}  // namespace holdfast

#else

namespace holdfast {

TriangleMesh WrapSurface(const TriangleMesh& mesh, double /*alpha_m*/, double /*offset_m*/) {
  RequireValid(mesh);
  throw Error("mesh", "must be wrapped first, and this build is without CGAL's GPL packages",
              "Make it manifold in a mesh editor, or build with HOLDFAST_GPL=ON");
}

}  // namespace holdfast

#endif
