// SPDX-License-Identifier: MIT
#include "geometry/score/clearance_memory.h"

#include <cmath>
#include <optional>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

// Twice the area (m^2) below which a triangle's orientation is undetermined.
constexpr double kFlat = 1e-16;

// Signed number of outward crossings of a closed surface by a ray from a point along an axis.
// Returns nothing if the ray hits an edge.
std::optional<int> PassesOutwards(const Solid& closed, const Eigen::Vector3d& point, int axis,
                                  bool upwards) {
  Eigen::Vector3d low = point, high = point;
  (upwards ? high : low)[axis] = (upwards ? closed.distance.Max() : closed.distance.Min())[axis];
  int passes = 0;
  for (const int face : closed.distance.Tree().FacesInBox(low, high)) {
    const Eigen::Matrix3d corners =
        closed.mesh.vertices(Eigen::all, closed.mesh.faces.col(face)).colwise() - point;
    const auto u = corners.row((axis + 1) % 3), v = corners.row((axis + 2) % 3);
    // Projected areas of the triangles spanned by the ray and each side.
    Eigen::Vector3d area;
    for (int k = 0; k < 3; ++k) {
      const int a = (k + 1) % 3, b = (k + 2) % 3;
      area[k] = u[a] * v[b] - u[b] * v[a];
    }
    if (area.minCoeff() < -kFlat && area.maxCoeff() > kFlat) continue;
    if (area.cwiseAbs().minCoeff() <= kFlat) return std::nullopt;
    const bool above = corners.row(axis).dot(area) / area.sum() > 0.0;
    if (above == upwards) passes += (area.sum() > 0.0) == upwards ? 1 : -1;
  }
  return passes;
}

}  // namespace

bool GoesAround(const Solid& closed, const Eigen::Vector3d& point) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool upwards : {true, false}) {
      if (const std::optional<int> passes = PassesOutwards(closed, point, axis, upwards)) {
        return *passes > 0;
      }
    }
  }
  return closed.distance.Inside(point);
}

SignedDistance::Result ClearanceMemory::Query(std::size_t i, const Eigen::Vector3d& point) {
  Known& k = known_[i];
  SignedDistance::Result result = solid_.distance.Query(point, k.face);
  const double distance = std::abs(result.distance);
  const double known = Clear(k);
  const bool closed = solid_.IsClosed();
  const bool outside =
      closed ? (known > 0.0 && OutsideBy(i, point) > -distance) || !GoesAround(solid_, point)
             : result.distance > 0.0;
  if (outside && result.distance < 0.0) {
    result.distance = distance;
    result.gradient = -result.gradient;
  }
  const double clear = closed ? distance : solid_.distance.SideHolds(point, distance);
  k = {point, distance, outside ? clear : 0.0, traveled_, result.face};
  return result;
}

}  // namespace holdfast
