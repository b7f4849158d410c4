// SPDX-License-Identifier: MIT
#include "geometry/mesh/half_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>

#include "geometry/mesh/mesh_topology.h"

namespace holdfast {

struct HalfEdges::Impl {
  struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
  };
  using Surface = OpenMesh::TriMesh_ArrayKernelT<Traits>;
  using Vertex = OpenMesh::VertexHandle;
  using HalfEdge = OpenMesh::HalfedgeHandle;

  Surface surface;
  std::vector<int> source;  // per vertex of `surface`: its id in the soup
  int apart = 0;

  Vertex Add(const TriangleMesh& mesh, int id) {
    const auto p = mesh.vertices.col(id);
    source.push_back(id);
    return surface.add_vertex({p.x(), p.y(), p.z()});
  }

  /// Whether add_face accepts the face. It would print a message for one that it refuses.
  bool Takes(const std::array<Vertex, 3>& corners) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!surface.is_boundary(corners[k])) return false;
      const HalfEdge side = surface.find_halfedge(corners[k], corners[(k + 1) % 3]);
      if (side.is_valid() && !surface.is_boundary(side)) return false;
    }
    return true;
  }

  int SourceFrom(HalfEdge side) const { return source[surface.from_vertex_handle(side).idx()]; }
};

HalfEdges::HalfEdges(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  // Faces that OpenMesh refuses, with a message to cerr, get vertices of their own below.
  [[maybe_unused]] static const bool quiet = omerr().disconnect(std::cerr);
  Impl& half = *impl_;
  for (int v = 0; v < mesh.NumVertices(); ++v) half.Add(mesh, v);
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const Eigen::Vector3i ids = mesh.faces.col(f);
    if (HasRepeatedCorner(ids)) continue;
    std::array<Impl::Vertex, 3> corners = {Impl::Vertex(ids[0]), Impl::Vertex(ids[1]),
                                           Impl::Vertex(ids[2])};
    if (half.Takes(corners) &&
        half.surface.add_face(corners[0], corners[1], corners[2]).is_valid()) {
      continue;
    }
    ++half.apart;
    for (int k = 0; k < 3; ++k) corners[k] = half.Add(mesh, ids[k]);
    half.surface.add_face(corners[0], corners[1], corners[2]);
  }
}

HalfEdges::~HalfEdges() = default;

int HalfEdges::NumApart() const { return impl_->apart; }

std::vector<std::vector<int>> HalfEdges::BoundaryLoops() const {
  const Impl::Surface& surface = impl_->surface;
  std::vector<bool> seen(surface.n_halfedges(), false);
  std::vector<std::vector<int>> loops;
  for (const Impl::HalfEdge start : surface.halfedges()) {
    if (!surface.is_boundary(start) || seen[start.idx()]) continue;
    std::vector<int>& loop = loops.emplace_back();
    // The open side of an edge runs against its face.
    for (Impl::HalfEdge side = start; !seen[side.idx()];
         side = surface.prev_halfedge_handle(side)) {
      seen[side.idx()] = true;
      loop.push_back(impl_->SourceFrom(surface.opposite_halfedge_handle(side)));
    }
  }
  return loops;
}

std::vector<std::pair<int, int>> HalfEdges::SharpEdges(double angle_rad) const {
  const Impl::Surface& surface = impl_->surface;
  std::vector<std::pair<int, int>> sharp;
  for (const OpenMesh::EdgeHandle edge : surface.edges()) {
    if (!surface.is_boundary(edge) && std::abs(surface.calc_dihedral_angle(edge)) <= angle_rad) {
      continue;
    }
    const Impl::HalfEdge side = surface.halfedge_handle(edge, 0);
    sharp.emplace_back(std::minmax(impl_->SourceFrom(side),
                                   impl_->SourceFrom(surface.opposite_halfedge_handle(side))));
  }
  std::ranges::sort(sharp);
  sharp.erase(std::unique(sharp.begin(), sharp.end()), sharp.end());
  return sharp;
}

}  // namespace holdfast
