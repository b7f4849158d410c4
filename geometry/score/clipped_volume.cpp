// SPDX-License-Identifier: MIT
#include "geometry/score/clipped_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include <Eigen/Geometry>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

using ExactPoint = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;

// Maximum gap of outlines relative to their length, and of area vectors relative to the area.
constexpr double kOutlineGap = 1e-7;

// Intersection of an edge with a face of the other solid.
struct Crossing {
  int low, high, face;  // vertices of the edge
  double share;         // fraction of the way from low to high
  bool enters;          // in that direction
  Eigen::Vector3d point;

  auto Edge() const { return std::pair(low, high); }
};

// Outline of the part of a face inside the other solid.
struct Outline {
  Eigen::Vector3d corner;
  Eigen::Vector3d area = Eigen::Vector3d::Zero(), gap = Eigen::Vector3d::Zero();
  double length = 0.0;

  void Add(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    area += 0.5 * (from - corner).cross(to - corner);
    gap += to - from;
    length += (to - from).norm();
  }
};

// The overlapping faces of one solid, with their crossings and outlines.
class ClippedFaces {
 public:
  ClippedFaces(const TriangleMesh& mesh, const std::vector<int>& faces)
      : mesh_(mesh), faces_(faces) {
    for (const int f : faces) outlines_.push_back({.corner = mesh.vertices.col(mesh.faces(0, f))});
  }

  const TriangleMesh& Mesh() const { return mesh_; }
  const std::vector<Outline>& Outlines() const { return outlines_; }
  Outline& OutlineOf(int face) {
    return outlines_[std::ranges::lower_bound(faces_, face) - faces_.begin()];
  }
  std::array<ExactPoint, 3> Corners(int face) const {
    std::array<ExactPoint, 3> corners;
    for (int k = 0; k < 3; ++k) {
      const auto p = mesh_.vertices.col(mesh_.faces(k, face));
      corners[k] = {p.x(), p.y(), p.z()};
    }
    return corners;
  }

  // Adds the crossing of the edge from corner k of `face` to the next, whose ends are on different
  // sides of `plane`, a face of the other solid; `side` is corner k's. Returns the crossing point.
  Eigen::Vector3d AddCrossing(int face, int k, int side, const TriangleMesh& other, int plane) {
    Crossing crossing{mesh_.faces(k, face), mesh_.faces((k + 1) % 3, face), plane, 0, side > 0, {}};
    if (crossing.low > crossing.high) {
      std::swap(crossing.low, crossing.high);
      crossing.enters = !crossing.enters;
    }
    const Eigen::Vector3d low = mesh_.vertices.col(crossing.low);
    const Eigen::Vector3d high = mesh_.vertices.col(crossing.high);
    const Eigen::Vector3d normal = FaceCross(other, plane);
    const Eigen::Vector3d corner = other.vertices.col(other.faces(0, plane));
    const double from = normal.dot(low - corner), to = normal.dot(high - corner);
    crossing.share = from == to ? 0.5 : std::clamp(from / (from - to), 0.0, 1.0);
    crossing.point = low + crossing.share * (high - low);
    crossings_.push_back(crossing);
    return crossing.point;
  }

  // Adds the parts of edges inside `other`. Returns false if crossings contradict each other.
  bool AddEdges(const SignedDistance& other) {
    SortCrossings();
    std::vector<int> ids;
    for (const int f : faces_) {
      for (const int v : mesh_.faces.col(f)) ids.push_back(v);
    }
    std::ranges::sort(ids);
    ids.erase(std::ranges::unique(ids).begin(), ids.end());
    const auto local = [&](int v) {
      return static_cast<int>(std::ranges::lower_bound(ids, v) - ids.begin());
    };
    // Vertices joined by an edge without crossings are on the same side.
    DisjointSets sets(static_cast<int>(ids.size()));
    ForEdges([&](Outline&, int from, int to, const auto& crossings) {
      if (crossings.empty()) sets.Merge(local(from), local(to));
    });
    std::vector<int> side(ids.size(), 0);  // of each set: 1 inside, -1 outside, 0 unknown
    const auto agrees = [&](int vertex, bool inside) {
      int& known = side[sets.Find(local(vertex))];
      if (known == 0) known = inside ? 1 : -1;
      return known == (inside ? 1 : -1);
    };
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
      const Crossing& c = crossings_[i];
      const bool first = i == 0 || crossings_[i - 1].Edge() != c.Edge();
      const bool last = i + 1 == crossings_.size() || crossings_[i + 1].Edge() != c.Edge();
      if (!first && crossings_[i - 1].enters == c.enters) return false;
      if (first && !agrees(c.low, !c.enters)) return false;
      if (last && !agrees(c.high, c.enters)) return false;
    }
    for (std::size_t i = 0; i < ids.size(); ++i) {
      int& known = side[sets.Find(static_cast<int>(i))];
      if (known == 0) known = other.Inside(mesh_.vertices.col(ids[i])) ? 1 : -1;
    }
    ForEdges([&](Outline& outline, int from, int to, const auto& crossings) {
      bool inside = side[sets.Find(local(std::min(from, to)))] > 0;
      Eigen::Vector3d begin = mesh_.vertices.col(std::min(from, to));
      const auto add = [&](const Eigen::Vector3d& end) {
        if (inside && from < to) outline.Add(begin, end);
        if (inside && from > to) outline.Add(end, begin);
        begin = end;
        inside = !inside;
      };
      for (const Crossing& crossing : crossings) add(crossing.point);
      add(mesh_.vertices.col(std::max(from, to)));
    });
    return true;
  }

 private:
  // Removes duplicates: each crossing was found from both faces of its edge.
  void SortCrossings() {
    std::ranges::sort(crossings_, [](const Crossing& a, const Crossing& b) {
      return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
    });
    const auto same = [](const Crossing& a, const Crossing& b) {
      return a.Edge() == b.Edge() && a.face == b.face;
    };
    crossings_.erase(std::ranges::unique(crossings_, same).begin(), crossings_.end());
    std::ranges::sort(crossings_, [](const Crossing& a, const Crossing& b) {
      return std::tie(a.low, a.high, a.share) < std::tie(b.low, b.high, b.share);
    });
  }

  template <typename Visit>
  void ForEdges(const Visit& visit) {
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        const int from = mesh_.faces(k, faces_[i]), to = mesh_.faces((k + 1) % 3, faces_[i]);
        visit(
            outlines_[i], from, to,
            std::ranges::equal_range(crossings_, std::pair(std::min(from, to), std::max(from, to)),
                                     {}, &Crossing::Edge));
      }
    }
  }

  const TriangleMesh& mesh_;
  const std::vector<int>& faces_;
  std::vector<Outline> outlines_;
  std::vector<Crossing> crossings_;
};

// Adds the common segment of two faces, if any. Returns false for any other kind of intersection.
bool AddCommonSegment(ClippedFaces& a, int face_a, ClippedFaces& b, int face_b) {
  ClippedFaces* const solids[2] = {&a, &b};
  const int faces[2] = {face_a, face_b};
  const std::array<ExactPoint, 3> corners[2] = {a.Corners(face_a), b.Corners(face_b)};
  std::array<int, 3> sides[2];
  for (const int s : {0, 1}) {
    const std::array<ExactPoint, 3>& plane = corners[1 - s];
    for (int k = 0; k < 3; ++k) {
      sides[s][k] = CGAL::orientation(plane[0], plane[1], plane[2], corners[s][k]);
    }
    if (std::ranges::count(sides[s], sides[s][0]) == 3 && sides[s][0] != 0) return true;
  }
  std::array<Eigen::Vector3d, 2> ends;
  std::size_t found = 0;
  for (const int s : {0, 1}) {
    if (std::ranges::count(sides[s], 0) > 0) return false;
    const std::array<ExactPoint, 3>& other = corners[1 - s];
    for (int k = 0; k < 3; ++k) {
      if (sides[s][k] == sides[s][(k + 1) % 3]) continue;
      std::array<int, 3> around;
      for (int m = 0; m < 3; ++m) {
        around[m] =
            CGAL::orientation(corners[s][k], corners[s][(k + 1) % 3], other[m], other[(m + 1) % 3]);
      }
      if (std::ranges::count(around, 0) > 0) return false;
      if (around[0] != around[1] || around[1] != around[2]) continue;
      if (found == 2) return false;
      ends[found++] =
          solids[s]->AddCrossing(faces[s], k, sides[s][k], solids[1 - s]->Mesh(), faces[1 - s]);
    }
  }
  if (found != 2) return found == 0;
  // On a's face, the part inside b is to the left.
  const Eigen::Vector3d along = FaceCross(a.Mesh(), face_a).cross(FaceCross(b.Mesh(), face_b));
  if (along.dot(ends[1] - ends[0]) < 0.0) std::swap(ends[0], ends[1]);
  a.OutlineOf(face_a).Add(ends[0], ends[1]);
  b.OutlineOf(face_b).Add(ends[1], ends[0]);
  return true;
}

}  // namespace

std::optional<double> ClippedVolume(const Solid& a, const Solid& b, const SolidOverlap& overlap) {
  ClippedFaces faces_a(a.mesh, overlap.faces_a), faces_b(b.mesh, overlap.faces_b);
  for (const int face : overlap.faces_b) {
    const Eigen::Matrix3d corners = b.mesh.vertices(Eigen::all, b.mesh.faces.col(face));
    for (const int other :
         a.distance.Tree().FacesInBox(corners.rowwise().minCoeff(), corners.rowwise().maxCoeff())) {
      if (!std::ranges::binary_search(overlap.faces_a, other)) continue;
      if (!AddCommonSegment(faces_a, other, faces_b, face)) return std::nullopt;
    }
  }
  if (!faces_a.AddEdges(b.distance) || !faces_b.AddEdges(a.distance)) return std::nullopt;
  const Eigen::Vector3d origin = overlap.box.center();
  Eigen::Vector3d area_vector = Eigen::Vector3d::Zero();
  double volume = 0.0, area = 0.0, gap = 0.0, length = 0.0;
  for (const ClippedFaces* faces : {&faces_a, &faces_b}) {
    for (const Outline& outline : faces->Outlines()) {
      volume += (outline.corner - origin).dot(outline.area) / 3.0;
      area_vector += outline.area;
      area += outline.area.norm();
      gap += outline.gap.norm();
      length += outline.length;
    }
  }
  if (gap > kOutlineGap * length || area_vector.norm() > kOutlineGap * area) return std::nullopt;
  return std::max(0.0, volume);
}

}  // namespace holdfast
