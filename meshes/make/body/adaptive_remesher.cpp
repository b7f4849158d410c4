// SPDX-License-Identifier: MIT
#include "meshes/make/body/adaptive_remesher.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>

namespace holdfast {
namespace {

using Eigen::Vector3d;
using Point = CGAL::Simple_cartesian<double>::Point_3;
using Surface = CGAL::Surface_mesh<Point>;
using Vertex = Surface::Vertex_index;
using Edge = Surface::Edge_index;
using Halfedge = Surface::Halfedge_index;
using Face = Surface::Face_index;

class Remesher {
 public:
  Remesher(const TriangleMesh& mesh, const RemeshTarget& target) : target_(target) {
    std::vector<Vertex> ids;
    for (Eigen::Index i = 0; i < mesh.NumVertices(); ++i) {
      ids.push_back(surface_.add_vertex(ToPoint(mesh.vertices.col(i))));
    }
    for (Eigen::Index i = 0; i < mesh.NumFaces(); ++i) {
      surface_.add_face(ids[mesh.faces(0, i)], ids[mesh.faces(1, i)], ids[mesh.faces(2, i)]);
    }
  }

  void Round() {
    SplitLongEdges();
    CollapseShortEdges();
    FlipForValence();
    Smooth();
    surface_.collect_garbage();
  }

  TriangleMesh Result() {
    surface_.collect_garbage();
    TriangleMesh mesh;
    mesh.vertices.resize(3, surface_.number_of_vertices());
    mesh.faces.resize(3, surface_.number_of_faces());
    for (const Vertex v : surface_.vertices()) mesh.vertices.col(v.idx()) = Position(v);
    for (const Face f : surface_.faces()) {
      int corner = 0;
      for (const Vertex v : surface_.vertices_around_face(surface_.halfedge(f))) {
        mesh.faces(corner++, f.idx()) = static_cast<int>(v.idx());
      }
    }
    return mesh;
  }

 private:
  static Point ToPoint(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }
  Vector3d Position(Vertex v) const {
    const Point& p = surface_.point(v);
    return {p.x(), p.y(), p.z()};
  }
  bool OnBorder(Vertex v) const { return surface_.is_border(v); }
  double Length(Halfedge h) const {
    return (Position(surface_.source(h)) - Position(surface_.target(h))).norm();
  }
  double Wanted(Halfedge h) const {
    return std::min(target_.edge_length(Position(surface_.source(h))),
                    target_.edge_length(Position(surface_.target(h))));
  }

  void SplitLongEdges() {
    const std::vector<Edge> edges(surface_.edges().begin(), surface_.edges().end());
    for (const Edge e : edges) {
      Halfedge h = surface_.halfedge(e);
      if (Length(h) <= 4.0 / 3.0 * Wanted(h)) continue;
      const bool border = surface_.is_border(e);
      const Vector3d middle = 0.5 * (Position(surface_.source(h)) + Position(surface_.target(h)));
      const Halfedge fresh = CGAL::Euler::split_edge(h, surface_);
      const Vertex v = surface_.target(fresh);
      surface_.point(v) = ToPoint(target_.project(middle, border));
      // Both sides have become quadrilaterals: cut them at the new vertex.
      for (const Halfedge side : {fresh, surface_.opposite(h)}) {
        if (surface_.is_border(side)) continue;
        const Halfedge apex = surface_.next(surface_.next(side));
        CGAL::Euler::split_face(side, apex, surface_);
      }
    }
  }

  /// Whether moving v to `position` keeps the faces around it (except those at `other`) from
  /// turning over, and its edges from becoming too long.
  bool MayMoveTo(Vertex v, Vertex other, const Vector3d& position) const {
    for (const Halfedge h : surface_.halfedges_around_target(surface_.halfedge(v))) {
      const Vector3d a = Position(surface_.source(h));
      if (surface_.source(h) != other &&
          (a - position).norm() >
              4.0 / 3.0 * std::min(target_.edge_length(a), target_.edge_length(position))) {
        return false;
      }
      if (surface_.is_border(h)) continue;
      const Vertex next = surface_.target(surface_.next(h));
      if (surface_.source(h) == other || next == other) continue;
      const Vector3d b = Position(next);
      const Vector3d p = Position(v);
      const Vector3d before = (p - a).cross(b - a);
      const Vector3d after = (position - a).cross(b - a);
      if (before.dot(after) < 0.3 * before.norm() * after.norm() || after.norm() < 1e-10) {
        return false;
      }
    }
    return true;
  }

  void CollapseShortEdges() {
    const std::vector<Edge> edges(surface_.edges().begin(), surface_.edges().end());
    for (const Edge e : edges) {
      if (surface_.is_removed(e)) continue;
      const Halfedge h = surface_.halfedge(e);
      if (Length(h) >= 4.0 / 5.0 * Wanted(h)) continue;
      const Vertex a = surface_.source(h);
      const Vertex b = surface_.target(h);
      const bool border_a = OnBorder(a), border_b = OnBorder(b);
      if (border_a && border_b && !surface_.is_border(e)) continue;
      if (!CGAL::Euler::does_satisfy_link_condition(e, surface_)) continue;
      Vector3d position;
      if (border_a == border_b) {
        position = target_.project(0.5 * (Position(a) + Position(b)), border_a);
      } else {
        position = Position(border_a ? a : b);
      }
      if (!MayMoveTo(a, b, position) || !MayMoveTo(b, a, position)) continue;
      const Vertex kept = CGAL::Euler::collapse_edge(e, surface_);
      surface_.point(kept) = ToPoint(position);
    }
  }

  void FlipForValence() {
    const auto excess = [&](Vertex v, int change) {
      const int wanted = OnBorder(v) ? 4 : 6;
      const int difference = static_cast<int>(surface_.degree(v)) + change - wanted;
      return difference * difference;
    };
    for (const Edge e : surface_.edges()) {
      if (surface_.is_border(e)) continue;
      const Halfedge h = surface_.halfedge(e);
      const Vertex a = surface_.source(h), b = surface_.target(h);
      const Vertex c = surface_.target(surface_.next(h));
      const Vertex d = surface_.target(surface_.next(surface_.opposite(h)));
      const int before = excess(a, 0) + excess(b, 0) + excess(c, 0) + excess(d, 0);
      const int after = excess(a, -1) + excess(b, -1) + excess(c, 1) + excess(d, 1);
      if (after >= before || surface_.halfedge(c, d) != Surface::null_halfedge()) continue;
      const Vector3d pa = Position(a), pb = Position(b), pc = Position(c), pd = Position(d);
      // Old faces abc, bad; new faces acd turned as adc / bcd: all must look the same way.
      const Vector3d old_normal =
          (pb - pa).cross(pc - pa).normalized() + (pa - pb).cross(pd - pb).normalized();
      const Vector3d first = (pd - pa).cross(pc - pa), second = (pc - pb).cross(pd - pb);
      if (first.normalized().dot(old_normal) < 1.2 || second.normalized().dot(old_normal) < 1.2) {
        continue;
      }
      if (std::min(SmallestAngle(pa, pd, pc), SmallestAngle(pb, pc, pd)) < 0.35 &&
          std::min(SmallestAngle(pa, pd, pc), SmallestAngle(pb, pc, pd)) <
              std::min(SmallestAngle(pa, pb, pc), SmallestAngle(pb, pa, pd))) {
        continue;
      }
      CGAL::Euler::flip_edge(h, surface_);
    }
  }

  static double SmallestAngle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const auto angle = [](const Vector3d& u, const Vector3d& v) {
      return std::atan2(u.cross(v).norm(), u.dot(v));
    };
    return std::min({angle(b - a, c - a), angle(c - b, a - b), angle(a - c, b - c)});
  }

  void Smooth() {
    std::vector<Vector3d> moved(surface_.num_vertices());
    for (const Vertex v : surface_.vertices()) {
      const Vector3d p = Position(v);
      moved[v.idx()] = p;
      Vector3d sum = Vector3d::Zero(), normal = Vector3d::Zero();
      double weight_sum = 0;
      if (OnBorder(v)) {
        for (const Halfedge h : surface_.halfedges_around_target(surface_.halfedge(v))) {
          if (!surface_.is_border(surface_.edge(h))) continue;
          sum += 0.5 * Position(surface_.source(h));
        }
        moved[v.idx()] = target_.project(p + 0.5 * (sum - p), true);
        continue;
      }
      for (const Halfedge h : surface_.halfedges_around_target(surface_.halfedge(v))) {
        const Vector3d a = Position(surface_.source(h));
        const Vector3d b = Position(surface_.target(surface_.next(h)));
        const Vector3d n = (p - a).cross(b - a);
        const Vector3d centroid = (a + b + p) / 3.0;
        // Area over the wanted area: a graded mesh is at rest.
        const double size = target_.edge_length(centroid);
        const double weight = n.norm() / (size * size);
        sum += weight * centroid;
        weight_sum += weight;
        normal += n;
      }
      if (weight_sum <= 0) continue;
      Vector3d move = sum / weight_sum - p;
      normal.normalize();
      move -= normal * normal.dot(move);
      moved[v.idx()] = target_.project(p + move, false);
    }
    for (const Vertex v : surface_.vertices()) {
      surface_.point(v) = ToPoint(moved[v.idx()]);
    }
  }

  const RemeshTarget& target_;
  Surface surface_;
};

}  // namespace

TriangleMesh Remesh(const TriangleMesh& mesh, const RemeshTarget& target, int rounds) {
  Remesher remesher(mesh, target);
  for (int round = 0; round < rounds; ++round) remesher.Round();
  return remesher.Result();
}

}  // namespace holdfast
