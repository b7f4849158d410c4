// SPDX-License-Identifier: MIT
#include "meshes/make/objects/remesher.h"

#include <array>
#include <numbers>
#include <utility>
#include <vector>

// The names of CGAL 5.5, which 6 has still.
#define CGAL_NO_DEPRECATION_WARNINGS
#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>
#include <Eigen/Geometry>

#include "geometry/error.h"

namespace holdfast {
namespace {

using solids::Field;
using solids::Vec3;

using Kernel = CGAL::Simple_cartesian<double>;
using Segments = std::vector<Kernel::Segment_3>;
using SegmentTree = CGAL::AABB_tree<
    CGAL::AABB_traits<Kernel, CGAL::AABB_segment_primitive<Kernel, Segments::iterator>>>;

/// A point that starts at zero: the mesh's default value is copied before it is set.
struct Position : Vec3 {
  Position() : Vec3(Vec3::Zero()) {}
  template <typename Derived>
  Position(const Eigen::MatrixBase<Derived>& other) : Vec3(other) {}
  using Vec3::operator=;
};

using Mesh = CGAL::Surface_mesh<Position>;
using Vertex = Mesh::Vertex_index;
using Edge = Mesh::Edge_index;
using Halfedge = Mesh::Halfedge_index;
using Face = Mesh::Face_index;

/// What a vertex may do: move on the surface, along a sharp edge, or not at all.
enum class Freedom { kSurface, kCrease, kFixed };

class Remesher {
 public:
  Remesher(const TriangleMesh& dense, const Field& solid, const ImplicitMesherOptions& options)
      : solid_(solid), options_(options) {
    for (Eigen::Index v = 0; v < dense.NumVertices(); ++v) mesh_.add_vertex(dense.vertices.col(v));
    for (Eigen::Index f = 0; f < dense.NumFaces(); ++f) {
      mesh_.add_face(Vertex(dense.faces(0, f)), Vertex(dense.faces(1, f)),
                     Vertex(dense.faces(2, f)));
    }
    FindCreases();
    FindFreedoms();
    for (const Edge edge : mesh_.edges()) {
      if (!crease_[edge]) continue;
      const Vec3& a = Point(mesh_.vertex(edge, 0));
      const Vec3& b = Point(mesh_.vertex(edge, 1));
      crease_segments_.emplace_back(Kernel::Point_3(a.x(), a.y(), a.z()),
                                    Kernel::Point_3(b.x(), b.y(), b.z()));
    }
    crease_tree_.insert(crease_segments_.begin(), crease_segments_.end());
    crease_tree_.build();
  }

  TriangleMesh Run() {
    constexpr int kPasses = 12;
    for (int pass = 0; pass < kPasses; ++pass) {
      if (pass == 0) {
        // Thin the dense mesh out first: measuring its curvature everywhere would take most of the
        // time.
        for (const Vertex v : mesh_.vertices()) size_[v] = options_.min_edge;
      } else {
        UpdateSizes();
        SplitLongEdges();
      }
      CollapseShortEdges();
      FlipEdges();
      for (int k = 0; k < 3; ++k) Relax();
    }
    FlipEdges();
    for (int k = 0; k < 3; ++k) Relax();
    return Result();
  }

 private:
  const Vec3& Point(Vertex v) const { return mesh_.point(v); }
  double Length(Edge e) const {
    return (Point(mesh_.vertex(e, 0)) - Point(mesh_.vertex(e, 1))).norm();
  }
  double WantedLength(Edge e) const {
    return std::min(size_[mesh_.vertex(e, 0)], size_[mesh_.vertex(e, 1)]);
  }

  /// Sharp edges: between faces whose exact normals differ. The faces of the dense mesh may be
  /// slivers, so the normals come from the field.
  void FindCreases() {
    const double limit = std::cos(options_.crease_degrees * std::numbers::pi / 180.0);
    std::vector<Vec3> normal(mesh_.num_faces());
    for (const Face face : mesh_.faces()) {
      Vec3 center = Vec3::Zero();
      for (const Vertex v : mesh_.vertices_around_face(mesh_.halfedge(face)))
        center += Point(v) / 3.0;
      normal[face] = SurfaceNormal(solid_, center);
    }
    for (const Edge edge : mesh_.edges()) {
      const Halfedge h = mesh_.halfedge(edge);
      crease_[edge] = normal[mesh_.face(h)].dot(normal[mesh_.face(mesh_.opposite(h))]) < limit;
    }
    // A sliver lying on a sharp edge is bordered by it on one side only: drop its longest edge.
    for (const Face face : mesh_.faces()) {
      int count = 0;
      Edge longest;
      for (const Halfedge h : mesh_.halfedges_around_face(mesh_.halfedge(face))) {
        const Edge edge = mesh_.edge(h);
        count += crease_[edge] ? 1 : 0;
        if (!longest.is_valid() || Length(edge) > Length(longest)) longest = edge;
      }
      if (count == 3) crease_[longest] = false;
    }
    PruneStubs();
  }

  /// Removes loose chains shorter than a few grid cells: noise where a fillet is barely sharp.
  void PruneStubs() {
    std::vector<char> seen(mesh_.num_edges(), 0);
    for (const Edge seed : mesh_.edges()) {
      if (!crease_[seed] || seen[seed]) continue;
      std::vector<Edge> chain{seed};
      seen[seed] = 1;
      double length = 0.0;
      for (std::size_t k = 0; k < chain.size(); ++k) {
        length += Length(chain[k]);
        for (int end = 0; end < 2; ++end) {
          const Vertex v = mesh_.vertex(chain[k], end);
          for (const Halfedge h : mesh_.halfedges_around_target(mesh_.halfedge(v))) {
            const Edge edge = mesh_.edge(h);
            if (!crease_[edge] || seen[edge]) continue;
            seen[edge] = 1;
            chain.push_back(edge);
          }
        }
      }
      if (length > 6.0 * options_.cell) continue;
      for (const Edge edge : chain) crease_[edge] = false;
    }
  }

  /// Crease neighbours of a vertex.
  std::vector<Vertex> CreaseNeighbours(Vertex v) const {
    std::vector<Vertex> neighbours;
    for (const Halfedge h : mesh_.halfedges_around_target(mesh_.halfedge(v))) {
      if (crease_[mesh_.edge(h)]) neighbours.push_back(mesh_.source(h));
    }
    return neighbours;
  }

  void FindFreedoms() {
    for (const Vertex v : mesh_.vertices()) {
      const auto neighbours = CreaseNeighbours(v);
      freedom_[v] = neighbours.empty()       ? Freedom::kSurface
                    : neighbours.size() == 2 ? Freedom::kCrease
                                             : Freedom::kFixed;
    }
    // Corners of a chain: seen over a few edges, since single ones wiggle with the grid.
    for (const Vertex v : mesh_.vertices()) {
      if (freedom_[v] != Freedom::kCrease) continue;
      const auto ends = CreaseNeighbours(v);
      const Vec3 a = Walk(v, ends[0]) - Point(v);
      const Vec3 b = Walk(v, ends[1]) - Point(v);
      if (a.normalized().dot(b.normalized()) > -0.64) freedom_[v] = Freedom::kFixed;
    }
  }

  /// The point three crease edges away from `from`, starting towards `to`.
  Vec3 Walk(Vertex from, Vertex to) const {
    for (int k = 0; k < 3; ++k) {
      const auto neighbours = CreaseNeighbours(to);
      if (neighbours.size() != 2) break;
      const Vertex next = neighbours[0] == from ? neighbours[1] : neighbours[0];
      from = to;
      to = next;
    }
    return Point(to);
  }

  /// Strongest curvature of the surface at a point, 1/mm.
  double Curvature(const Vec3& point) const {
    const double step = 0.25 * options_.min_edge;
    const Vec3 normal = SurfaceNormal(solid_, point);
    const Vec3 u = normal.unitOrthogonal();
    const Vec3 v = normal.cross(u);
    const auto change = [&](const Vec3& direction) -> Vec3 {
      return (SurfaceNormal(solid_, point + step * direction) -
              SurfaceNormal(solid_, point - step * direction)) /
             (2.0 * step);
    };
    const Vec3 along_u = change(u);
    const Vec3 along_v = change(v);
    const double a = along_u.dot(u);
    const double b = 0.5 * (along_u.dot(v) + along_v.dot(u));
    const double c = along_v.dot(v);
    return 0.5 * std::abs(a + c) + std::hypot(0.5 * (a - c), b);
  }

  /// Edge lengths wanted: chords within the error allowed, growing gently from vertex to vertex.
  void UpdateSizes() {
    for (const Vertex v : mesh_.vertices()) {
      size_[v] = options_.max_edge;
      if (freedom_[v] != Freedom::kSurface) continue;
      const double radius = 1.0 / std::max(Curvature(Point(v)), 1e-9);
      size_[v] = std::clamp(std::sqrt(8.0 * options_.chord_error * radius), options_.min_edge,
                            options_.max_edge);
    }
    constexpr double kGrowth = 0.35;
    for (int sweep = 0; sweep < 40; ++sweep) {
      bool changed = false;
      for (const Edge edge : mesh_.edges()) {
        const Vertex a = mesh_.vertex(edge, 0);
        const Vertex b = mesh_.vertex(edge, 1);
        const double slack = kGrowth * Length(edge);
        if (size_[a] > size_[b] + slack + 1e-9) size_[a] = size_[b] + slack, changed = true;
        if (size_[b] > size_[a] + slack + 1e-9) size_[b] = size_[a] + slack, changed = true;
      }
      if (!changed) break;
    }
  }

  void SplitLongEdges() {
    const std::vector<Edge> edges(mesh_.edges().begin(), mesh_.edges().end());
    for (const Edge edge : edges) {
      if (Length(edge) <= 4.0 / 3.0 * WantedLength(edge)) continue;
      const Vertex a = mesh_.vertex(edge, 0);
      const Vertex b = mesh_.vertex(edge, 1);
      const bool crease = crease_[edge];
      const Halfedge old = mesh_.halfedge(edge);
      const Halfedge to_new = CGAL::Euler::split_edge(old, mesh_);
      const Vertex middle = mesh_.target(to_new);
      mesh_.point(middle) = 0.5 * (Point(a) + Point(b));
      size_[middle] = 0.5 * (size_[a] + size_[b]);
      freedom_[middle] = crease ? Freedom::kCrease : Freedom::kSurface;
      crease_[mesh_.edge(to_new)] = crease;
      crease_[mesh_.edge(old)] = crease;
      const Halfedge side_a = CGAL::Euler::split_face(to_new, mesh_.next(old), mesh_);
      const Halfedge back = mesh_.opposite(old);
      const Halfedge side_b = CGAL::Euler::split_face(back, mesh_.next(mesh_.next(back)), mesh_);
      crease_[mesh_.edge(side_a)] = false;
      crease_[mesh_.edge(side_b)] = false;
      Project(middle);
    }
  }

  void CollapseShortEdges() {
    for (int round = 0; round < 8; ++round) {
      bool changed = false;
      const std::vector<Edge> edges(mesh_.edges().begin(), mesh_.edges().end());
      for (const Edge edge : edges) {
        if (mesh_.is_removed(edge)) continue;
        if (Length(edge) >= 4.0 / 5.0 * WantedLength(edge)) continue;
        const Halfedge h = mesh_.halfedge(edge);
        changed |= TryCollapse(h) || TryCollapse(mesh_.opposite(h));
      }
      mesh_.collect_garbage();
      if (!changed) break;
    }
  }

  /// Moves the source of `h` onto its target, if sharp edges, lengths and orientations allow.
  bool TryCollapse(Halfedge h) {
    const Vertex gone = mesh_.source(h);
    const Vertex kept = mesh_.target(h);
    const Edge edge = mesh_.edge(h);
    if (freedom_[gone] == Freedom::kFixed) return false;
    if (freedom_[gone] == Freedom::kCrease && !crease_[edge]) return false;
    if (!CGAL::Euler::does_satisfy_link_condition(edge, mesh_)) return false;
    const bool slide = freedom_[gone] == Freedom::kSurface && freedom_[kept] == Freedom::kSurface;
    const Vec3 goal = slide ? Vec3(0.5 * (Point(gone) + Point(kept))) : Point(kept);
    for (const Vertex v : {gone, kept}) {
      if (v == kept && !slide) continue;
      for (const Halfedge spoke : mesh_.halfedges_around_target(mesh_.halfedge(v))) {
        const Vertex tip = mesh_.source(spoke);
        if (tip == gone || tip == kept) continue;
        if ((Point(tip) - goal).norm() > 4.0 / 3.0 * std::min(size_[tip], size_[kept]))
          return false;
      }
      if (!KeepsOrientation(v, goal, v == gone ? kept : gone)) return false;
    }
    // The two triangles at the edge close: each passes a sharp edge on to the side that stays.
    std::array<std::pair<Vertex, bool>, 2> wings;
    for (int side = 0; side < 2; ++side) {
      const Halfedge s = side == 0 ? h : mesh_.opposite(h);
      const bool first = crease_[mesh_.edge(mesh_.next(s))];
      const bool second = crease_[mesh_.edge(mesh_.prev(s))];
      if (first && second) return false;
      wings[side] = {mesh_.target(mesh_.next(s)), first || second};
    }
    const Freedom freedom = freedom_[kept];
    const double size = std::min(size_[gone], size_[kept]);
    const Vertex left = CGAL::Euler::collapse_edge(edge, mesh_);
    mesh_.point(left) = goal;
    freedom_[left] = freedom;
    size_[left] = size;
    for (const auto& [tip, crease] : wings) {
      crease_[mesh_.edge(mesh_.halfedge(left, tip))] = crease;
    }
    if (slide) Project(left);
    return true;
  }

  /// Whether the faces around `v`, other than those shared with `ignored`, stay well oriented when
  /// v moves to `goal`.
  bool KeepsOrientation(Vertex v, const Vec3& goal, Vertex ignored) const {
    for (const Halfedge h : mesh_.halfedges_around_target(mesh_.halfedge(v))) {
      const Vertex a = mesh_.source(h);
      const Vertex b = mesh_.target(mesh_.next(h));
      if (a == ignored || b == ignored) continue;
      const Vec3 before = (Point(v) - Point(a)).cross(Point(b) - Point(a));
      const Vec3 after = (goal - Point(a)).cross(Point(b) - Point(a));
      if (after.dot(before) < 0.5 * after.norm() * before.norm()) return false;
      // A needle: its height is far below its base.
      const double longest =
          std::max({(goal - Point(a)).squaredNorm(), (Point(b) - Point(a)).squaredNorm(),
                    (Point(b) - goal).squaredNorm()});
      if (after.norm() < 0.08 * longest && after.norm() < 0.9 * before.norm()) return false;
    }
    return true;
  }

  void FlipEdges() {
    for (int round = 0; round < 3; ++round) {
      bool changed = false;
      for (const Edge edge : mesh_.edges()) {
        if (crease_[edge]) continue;
        const Halfedge h = mesh_.halfedge(edge);
        const Halfedge g = mesh_.opposite(h);
        const Vertex a = mesh_.source(h);
        const Vertex b = mesh_.target(h);
        const Vertex c = mesh_.target(mesh_.next(h));
        const Vertex d = mesh_.target(mesh_.next(g));
        if (c == d || mesh_.halfedge(c, d).is_valid()) continue;
        if (mesh_.degree(a) <= 3 || mesh_.degree(b) <= 3) continue;
        if (!FlipHelps(Point(a), Point(b), Point(c), Point(d))) continue;
        CGAL::Euler::flip_edge(h, mesh_);
        changed = true;
      }
      if (!changed) break;
    }
  }

  /// Delaunay on the surface: flip where the angles opposite the edge sum to more than a straight
  /// angle, and the two triangles are flat enough to be seen as one plane piece.
  static bool FlipHelps(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto angle = [](const Vec3& at, const Vec3& p, const Vec3& q) {
      return std::acos(std::clamp((p - at).normalized().dot((q - at).normalized()), -1.0, 1.0));
    };
    if (angle(c, a, b) + angle(d, a, b) < std::numbers::pi + 0.02) return false;
    const Vec3 n1 = (b - a).cross(c - a).normalized();
    const Vec3 n2 = (d - a).cross(b - a).normalized();
    const Vec3 m1 = (d - c).cross(b - c).normalized();
    const Vec3 m2 = (a - c).cross(d - c).normalized();
    const Vec3 mean = n1 + n2;
    return m1.dot(m2) > 0.5 && m1.dot(mean) > 0.2 && m2.dot(mean) > 0.2;
  }

  /// Moves vertices towards the middle of their surroundings, weighted so that the sizing survives.
  void Relax() {
    for (const Vertex v : mesh_.vertices()) {
      if (freedom_[v] == Freedom::kFixed) continue;
      const Vec3 old = Point(v);
      Vec3 goal = Vec3::Zero();
      if (freedom_[v] == Freedom::kCrease) {
        const auto ends = CreaseNeighbours(v);
        if (ends.size() != 2) continue;
        goal = old + 0.5 * (0.5 * (Point(ends[0]) + Point(ends[1])) - old);
      } else {
        double total = 0.0;
        for (const Halfedge h : mesh_.halfedges_around_target(mesh_.halfedge(v))) {
          const Vertex a = mesh_.source(h);
          const Vertex b = mesh_.target(mesh_.next(h));
          const double area = (Point(a) - old).cross(Point(b) - old).norm();
          const double size = (size_[v] + size_[a] + size_[b]) / 3.0;
          const double weight = area / (size * size);
          goal += weight / 3.0 * (Point(a) + Point(b) + old);
          total += weight;
        }
        if (total <= 0.0) continue;
        goal /= total;
        const Vec3 normal = SurfaceNormal(solid_, old);
        goal -= normal * normal.dot(goal - old);
      }
      mesh_.point(v) = goal;
      Project(v);
      const Vec3 moved = Point(v);
      mesh_.point(v) = old;
      if ((moved - old).norm() < size_[v] && KeepsOrientation(v, moved, v)) mesh_.point(v) = moved;
    }
  }

  void Project(Vertex v) {
    Position& point = mesh_.point(v);
    if (freedom_[v] == Freedom::kCrease) {
      const auto closest = crease_tree_.closest_point({point.x(), point.y(), point.z()});
      point = Vec3(closest.x(), closest.y(), closest.z());
      return;
    }
    if (freedom_[v] == Freedom::kFixed) return;
    constexpr double kStep = 0.01;
    for (int k = 0; k < 4; ++k) {
      const double value = solid_(point);
      if (std::abs(value) < 1e-5) return;
      Vec3 gradient;
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3 step = kStep * Vec3::Unit(axis);
        gradient[axis] = (solid_(point + step) - solid_(point - step)) / (2.0 * kStep);
      }
      const double squared = gradient.squaredNorm();
      if (squared < 0.01) return;
      const Vec3 move = -value / squared * gradient;
      point += move * std::min(1.0, 0.5 * options_.max_edge / std::max(move.norm(), 1e-12));
    }
  }

  TriangleMesh Result() {
    mesh_.collect_garbage();
    TriangleMesh result;
    result.vertices.resize(3, mesh_.num_vertices());
    result.faces.resize(3, mesh_.num_faces());
    for (const Vertex v : mesh_.vertices())
      result.vertices.col(static_cast<Eigen::Index>(v)) = Point(v);
    for (const Face f : mesh_.faces()) {
      int k = 0;
      for (const Vertex v : mesh_.vertices_around_face(mesh_.halfedge(f))) {
        result.faces(k++, static_cast<Eigen::Index>(f)) = static_cast<int>(v);
      }
    }
    return result;
  }

  const Field& solid_;
  const ImplicitMesherOptions& options_;
  Mesh mesh_;
  Mesh::Property_map<Edge, bool> crease_ =
      mesh_.add_property_map<Edge, bool>("e:crease", false).first;
  Mesh::Property_map<Vertex, Freedom> freedom_ =
      mesh_.add_property_map<Vertex, Freedom>("v:freedom", Freedom::kSurface).first;
  Mesh::Property_map<Vertex, double> size_ =
      mesh_.add_property_map<Vertex, double>("v:size", 0.0).first;
  Segments crease_segments_;
  SegmentTree crease_tree_;
};

}  // namespace

TriangleMesh RemeshOnSurface(const TriangleMesh& dense, const Field& solid,
                             const ImplicitMesherOptions& options) {
  return Remesher(dense, solid, options).Run();
}

}  // namespace holdfast
