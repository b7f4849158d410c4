// SPDX-License-Identifier: MIT
#include "geometry/mesh/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/mesh/winding_number.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

// Closer to the surface than this fraction of the mesh's size, the direction to the closest point
// is rounding noise, and the pseudonormal is the better gradient.
constexpr double kOnSurface = 1e-12;
constexpr Eigen::Index kManyClosing = 1000;

}  // namespace

struct SignedDistance::Impl {
  explicit Impl(const TriangleMesh& given) : tree(given), mesh(given) {
    std::tie(begin, around) = CornersByVertex(mesh.faces, mesh.NumVertices());
    for (int& corner : around) corner /= 3;
    watertight = CheckMesh(mesh).watertight;
    Prepare();
  }

  /// Computes the data that depends on vertex positions, except the tree.
  void Prepare() {
    surface_tolerance = kOnSurface * (tree.Max() - tree.Min()).norm();
    if (watertight) return;
    TriangleMesh whole = ClosingTriangles(mesh);
    if (whole.NumFaces() > kManyClosing && 4 * whole.NumFaces() > mesh.NumFaces()) {
      plain = std::make_unique<WindingNumber>(mesh);
      return;
    }
    closing = std::make_unique<WindingNumber>(whole);
    FindHoles(whole);
    Append(mesh, whole);
    closed = std::make_unique<WindingNumber>(whole);
  }

  /// Finds the bounding balls of the holes, if the closing triangles make the surface watertight.
  void FindHoles(const TriangleMesh& fans) {
    holes.clear();
    if (!closes.has_value()) {
      const std::vector<int> place = FirstAtSamePlace(mesh.vertices);
      const bool welded = std::ranges::all_of(mesh.faces.reshaped(),
                                              [&](int vertex) { return place[vertex] == vertex; });
      TriangleMesh joined{fans.vertices, Eigen::Matrix3Xi(3, mesh.NumFaces() + fans.NumFaces())};
      joined.faces << mesh.faces, fans.faces;
      closes = welded && CheckMesh(joined).watertight;
    }
    if (!*closes) return;
    std::map<int, Hole> by_middle;  // keyed by the common corner of all triangles of a hole
    for (Eigen::Index f = 0; f < fans.NumFaces(); ++f) {
      const int middle = fans.faces(2, f);
      Hole& hole = by_middle[middle];
      hole.center = fans.vertices.col(middle);
      hole.area += 0.5 * FaceCross(fans, f).norm();
      for (const int vertex : fans.faces.col(f)) {
        hole.radius = std::max(hole.radius, (fans.vertices.col(vertex) - hole.center).norm());
      }
    }
    for (const auto& [middle, hole] : by_middle) holes.push_back(hole);
  }

  /// Lower bound on how far a point at `distance` from the mesh can move until the closing
  /// triangles are nearest, or fill half of all directions. While neither holds, the side of the
  /// nearest mesh surface is also the side of the closed surface.
  double ReachOfSide(const Eigen::Vector3d& point, double distance) const {
    constexpr double kMaxSeen = 0.45;
    double reach = holes.empty() ? 0.0 : distance;
    for (const Hole& hole : holes) {
      // The solid-angle budget is split among the holes.
      const double apart = std::sqrt(hole.area * static_cast<double>(holes.size()) /
                                     (4.0 * std::numbers::pi * kMaxSeen));
      const double gap = (point - hole.center).norm() - hole.radius;
      reach = std::min({reach, gap - distance, gap - apart});
      if (reach <= 0.0) return 0.0;
    }
    return reach;
  }

  /// Calls visit(face) for the faces of the feature nearest to the point.
  template <typename Visit>
  void ForFaces(const TriangleTree::Hit& hit, const Visit& visit) const {
    using enum TriangleFeature;
    if (hit.feature == kFace) return visit(hit.face);
    const bool at_vertex = hit.feature >= kVertex0;
    const int corner =
        static_cast<int>(hit.feature) - static_cast<int>(at_vertex ? kVertex0 : kEdge01);
    const int vertex = mesh.faces(corner, hit.face);
    const int other = mesh.faces((corner + 1) % 3, hit.face);
    for (int i = begin[vertex]; i < begin[vertex + 1]; ++i) {
      if (at_vertex || (mesh.faces.col(around[i]).array() == other).any()) visit(around[i]);
    }
  }

  /// Angle-weighted at a vertex; at an edge the mean of the faces, in any orientation of the edge.
  Eigen::Vector3d Pseudonormal(const TriangleTree::Hit& hit) const {
    const bool at_vertex = hit.feature >= TriangleFeature::kVertex0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    ForFaces(hit, [&](int f) {
      const Eigen::Vector3d normal = FaceCross(mesh, f).stableNormalized();
      sum += at_vertex ? CornerAngle(f, hit.point) * normal : normal;
    });
    return sum.stableNormalized();
  }

  /// Angle of face f at its corner at position `place`.
  double CornerAngle(int f, const Eigen::Vector3d& place) const {
    int k = 0;
    while (k < 2 && mesh.vertices.col(mesh.faces(k, f)) != place) ++k;
    const Eigen::Vector3d u = mesh.vertices.col(mesh.faces((k + 1) % 3, f)) - place;
    const Eigen::Vector3d v = mesh.vertices.col(mesh.faces((k + 2) % 3, f)) - place;
    return std::acos(std::clamp(u.normalized().dot(v.normalized()), -1.0, 1.0));
  }

  /// Whether a point is behind the surface nearest to it.
  bool IsBehind(const Eigen::Vector3d& point, const TriangleTree::Hit& hit) const {
    const Eigen::Vector3d away = point - hit.point;
    bool before = false, behind = false;
    ForFaces(hit, [&](int f) {
      const double side = away.dot(FaceCross(mesh, f));
      before = before || side >= 0.0;
      behind = behind || side <= 0.0;
    });
    // If all faces agree, so does any weighted mean of their normals.
    return before && behind ? away.dot(Pseudonormal(hit)) < 0.0 : behind;
  }

  /// Winding number of the surface: that of the closed surface, an integer counted by a ray, minus
  /// that of the few closing triangles.
  double Winding(const Eigen::Vector3d& point) const {
    if (plain) return plain->At(point);
    const Eigen::Vector3d below = point - tree.Min(), above = tree.Max() - point;
    Eigen::Index axis, other;
    const bool ascending = above.minCoeff(&axis) < below.minCoeff(&other);  // the shortest way out
    return closed->Crossings(point, static_cast<int>(ascending ? axis : other), ascending) -
           closing->At(point);
  }

  double Signed(const Eigen::Vector3d& point, const TriangleTree::Hit& hit) const {
    const double distance = std::sqrt(hit.squared_distance);
    const bool by_side = watertight || ReachOfSide(point, distance) > 0.0;
    const bool inside = by_side ? IsBehind(point, hit) : distance > 0.0 && Winding(point) > 0.5;
    return inside ? -distance : distance;
  }

  TriangleTree tree;
  TriangleMesh mesh;
  std::vector<int> begin, around;  // faces around vertex v: around[begin[v]] ...
  double surface_tolerance = 0.0;
  bool watertight = true;
  // Only for meshes that are not watertight: the mesh with its closing triangles, and those
  // triangles alone. `plain` is the mesh as it is, for meshes with so much boundary that many
  // slivers would close it.
  std::unique_ptr<WindingNumber> closed, closing, plain;
  struct Hole {
    Eigen::Vector3d center;
    double radius = 0.0, area = 0.0;
  };
  std::vector<Hole> holes;     // empty if the closing triangles do not make it watertight
  std::optional<bool> closes;  // whether the closing triangles make it watertight
};

SignedDistance::SignedDistance(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
SignedDistance::~SignedDistance() = default;
SignedDistance::SignedDistance(SignedDistance&&) noexcept = default;
SignedDistance& SignedDistance::operator=(SignedDistance&&) noexcept = default;

bool SignedDistance::IsWatertight() const { return impl_->watertight; }
const Eigen::Vector3d& SignedDistance::Min() const { return impl_->tree.Min(); }
const Eigen::Vector3d& SignedDistance::Max() const { return impl_->tree.Max(); }

const TriangleTree& SignedDistance::Tree() const { return impl_->tree; }

void SignedDistance::Move(const Eigen::Matrix3Xd& vertices) {
  if (vertices.cols() != impl_->mesh.NumVertices()) {
    throw Error("vertices", "are not as many as the surface has", "Move each of its vertices");
  }
  impl_->mesh.vertices = vertices;
  impl_->tree.Move(impl_->mesh);
  impl_->Prepare();
}

double SignedDistance::Distance(const Eigen::Vector3d& point) const {
  return impl_->Signed(point, impl_->tree.Closest(point));
}

bool SignedDistance::Inside(const Eigen::Vector3d& point, const TriangleTree::Hit& nearest) const {
  return impl_->Signed(point, nearest) < 0.0;
}

double SignedDistance::SideHolds(const Eigen::Vector3d& point, double distance) const {
  const double away = std::abs(distance);
  return impl_->watertight ? away : impl_->ReachOfSide(point, away);
}

SignedDistance::Result SignedDistance::Query(const Eigen::Vector3d& point, int hint_face) const {
  const TriangleTree::Hit hit = impl_->tree.Closest(point, hint_face);
  Result result;
  result.distance = impl_->Signed(point, hit);
  result.closest = hit.point;
  result.face = hit.face;
  if (std::abs(result.distance) > impl_->surface_tolerance) {
    result.gradient = (point - hit.point) / result.distance;
  } else {
    result.gradient = impl_->Pseudonormal(hit);
  }
  return result;
}

Eigen::VectorXd SignedDistance::Distances(const Eigen::Matrix3Xd& points, int threads) const {
  Eigen::VectorXd distances(points.cols());
  constexpr Eigen::Index kBlock = 1024;
  const auto block = [&](Eigen::Index begin) {
    TriangleTree::Hit last;
    for (Eigen::Index i = begin; i < std::min(begin + kBlock, points.cols()); ++i) {
      last = impl_->tree.Closest(points.col(i), last.face);
      distances[i] = impl_->Signed(points.col(i), last);
    }
  };
  const Eigen::Index num_blocks = (points.cols() + kBlock - 1) / kBlock;
  ParallelFor(static_cast<int>(num_blocks), threads, [&](int b) { block(b * kBlock); });
  return distances;
}

}  // namespace holdfast
