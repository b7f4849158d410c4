// SPDX-License-Identifier: MIT
#include "geometry/score/exact_intersection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>

#include "geometry/score/clipped_volume.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/cut_surfaces.h"

namespace holdfast {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Triangle_3 CgalTriangle(const TriangleMesh& mesh, Eigen::Index face) {
  const auto point = [&](int k) {
    const Eigen::Vector3d p = mesh.vertices.col(mesh.faces(k, face));
    return Kernel::Point_3(p.x(), p.y(), p.z());
  };
  return {point(0), point(1), point(2)};
}

bool AnyInside(const Eigen::Matrix3Xd& points, const SignedDistance& body) {
  for (const auto& point : points.colwise()) {
    if ((point.array() < body.Min().array()).any() || (point.array() > body.Max().array()).any()) {
      continue;
    }
    if (body.Inside(point)) return true;
  }
  return false;
}

ExactVolume Failed(VolumeStatus status) { return {status, 0.0}; }

// Cuts faces only if necessary.
ExactVolume VolumeOf(const Solid& solid, const Solid& other, const SolidOverlap& overlap) {
  if (const std::optional<double> clipped = ClippedVolume(solid, other, overlap)) {
    return {VolumeStatus::kExact, *clipped};
  }
  return CutVolume(solid, other, overlap);
}

}  // namespace

Solid::Solid(TriangleMesh surface, bool close_holes)
    : mesh(close_holes ? CloseHoles(surface) : std::move(surface)), distance(mesh) {}

std::string_view Describe(VolumeStatus status) {
  constexpr std::array<std::string_view, 5> kClauses = {
      "exact", "a surface is not closed and bounds no volume",
      "a surface intersects itself where the two solids overlap", "the cut surfaces do not close",
      "this build is without CGAL's GPL packages (HOLDFAST_GPL=OFF)"};
  return kClauses[static_cast<std::size_t>(status)];
}

SolidOverlap FindOverlap(const Solid& a, const Solid& b, const Eigen::VectorXd& distances_b,
                         std::span<const int> inside_b) {
  std::vector<bool> takes_a(a.mesh.NumFaces(), false), takes_b(b.mesh.NumFaces(), false);
  if (!inside_b.empty()) {
    std::vector<bool> inside(a.mesh.NumVertices(), false);
    for (const int v : inside_b) inside[v] = true;
    for (Eigen::Index f = 0; f < a.mesh.NumFaces(); ++f) {
      const auto face = a.mesh.faces.col(f);
      takes_a[f] = inside[face[0]] || inside[face[1]] || inside[face[2]];
    }
  }
  for (Eigen::Index f = 0; f < b.mesh.NumFaces(); ++f) {
    const Eigen::Vector3i face = b.mesh.faces.col(f);
    const Eigen::Vector3d distances = distances_b(face);
    takes_b[f] = distances.minCoeff() < 0.0;
    const Eigen::Matrix3d corners = b.mesh.vertices(Eigen::all, face);
    const double longest2 = std::max({(corners.col(1) - corners.col(0)).squaredNorm(),
                                      (corners.col(2) - corners.col(1)).squaredNorm(),
                                      (corners.col(0) - corners.col(2)).squaredNorm()});
    // Each point of a triangle is within (longest edge / sqrt(3)) of a corner.
    if (3.0 * distances.cwiseAbs2().minCoeff() > longest2) continue;
    const Kernel::Triangle_3 triangle = CgalTriangle(b.mesh, f);
    for (const int other :
         a.distance.Tree().FacesInBox(corners.rowwise().minCoeff(), corners.rowwise().maxCoeff())) {
      if (takes_a[other] && takes_b[f]) continue;
      if (CGAL::do_intersect(triangle, CgalTriangle(a.mesh, other))) {
        takes_a[other] = takes_b[f] = true;
      }
    }
  }
  SolidOverlap overlap;
  const auto collect = [&](const TriangleMesh& mesh, const std::vector<bool>& takes,
                           std::vector<int>& faces) {
    for (int f = 0; f < mesh.NumFaces(); ++f) {
      if (!takes[f]) continue;
      faces.push_back(f);
      for (int k = 0; k < 3; ++k) overlap.box.extend(mesh.vertices.col(mesh.faces(k, f)));
    }
  };
  collect(a.mesh, takes_a, overlap.faces_a);
  collect(b.mesh, takes_b, overlap.faces_b);
  return overlap;
}

struct ExactIntersection::Crossings {
  std::once_flag looked;
  Eigen::Matrix3Xd places;
};

ExactIntersection::ExactIntersection(const Solid& solid)
    : solid_(&solid), all_(std::make_shared<Crossings>()) {}

// Faces that intersect each other inside the other solid are among the overlapping faces; if these
// are few, they are tested first. The rim of a part may falsely seem to intersect itself.
bool ExactIntersection::CrossesItselfIn(const Solid& other, const SolidOverlap& overlap) const {
  constexpr std::size_t kFew = 200;
  if (overlap.faces_a.size() <= kFew &&
      !AnyInside(SelfCrossings(solid_->mesh, overlap.faces_a), other.distance)) {
    return false;
  }
  std::call_once(all_->looked, [&] {
    std::vector<int> all(static_cast<std::size_t>(solid_->mesh.NumFaces()));
    std::iota(all.begin(), all.end(), 0);
    all_->places = SelfCrossings(solid_->mesh, all);
  });
  return AnyInside(all_->places, other.distance);
}

ExactVolume ExactIntersection::With(const Solid& other) const {
  if (!solid_->IsClosed() || !other.IsClosed()) return Failed(VolumeStatus::kOpenSurface);
  const Eigen::VectorXd inside = other.distance.Distances(solid_->mesh.vertices);
  std::vector<int> inside_other;
  for (int v = 0; v < inside.size(); ++v) {
    if (inside[v] < 0.0) inside_other.push_back(v);
  }
  return With(other, FindOverlap(*solid_, other, solid_->distance.Distances(other.mesh.vertices),
                                 inside_other));
}

ExactVolume ExactIntersection::With(const Solid& other, const SolidOverlap& overlap) const {
  if (!solid_->IsClosed() || !other.IsClosed()) return Failed(VolumeStatus::kOpenSurface);
  if (overlap.box.isEmpty()) return {};
  if (!CanCutSurfaces()) return Failed(VolumeStatus::kNotBuilt);
  const SignedDistance& a = solid_->distance;
  const SignedDistance& b = other.distance;
  if (CrossesItselfIn(other, overlap)) return Failed(VolumeStatus::kSelfIntersecting);
  if (!AnyInside(SelfCrossings(other.mesh, overlap.faces_b), a)) {
    const ExactVolume volume = VolumeOf(*solid_, other, overlap);
    if (volume.Known()) return volume;
  }
  // If the overlapping faces do not suffice, retry with all faces in the common bounding box.
  SolidOverlap whole = overlap;
  const Eigen::Vector3d low = a.Min().cwiseMax(b.Min());
  const Eigen::Vector3d high = a.Max().cwiseMin(b.Max());
  whole.faces_a = a.Tree().FacesInBox(low, high);
  whole.faces_b = b.Tree().FacesInBox(low, high);
  std::ranges::sort(whole.faces_a);
  std::ranges::sort(whole.faces_b);
  if (AnyInside(SelfCrossings(other.mesh, whole.faces_b), a)) {
    return Failed(VolumeStatus::kSelfIntersecting);
  }
  return VolumeOf(*solid_, other, whole);
}

ExactVolume ExactIntersectionVolume(const TriangleMesh& a, const TriangleMesh& b) {
  const Solid solid_a(a), solid_b(b);
  return ExactIntersection(solid_a).With(solid_b);
}

}  // namespace holdfast
