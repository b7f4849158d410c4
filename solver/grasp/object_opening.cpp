// SPDX-License-Identifier: MIT
#include "solver/grasp/object_opening.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// Whether a ray meets the object.
bool Meets(const DistanceGrid& object, const Vector3d& from, const Vector3d& way, double farthest) {
  for (double s = 0.0; s < farthest;) {
    const double d = object.Distance(from + s * way);
    if (d < 0.0006) return true;
    s += std::max(d, 0.0005);
  }
  return false;
}

ObjectOpening OpeningTowards(const ObjectShape& shape, const Vector3d& up) {
  constexpr int kStride = 6, kRays = 8;
  constexpr double kOff = 0.006;
  const double size = Extent(shape.mesh).norm();
  const Vector3d x = up.unitOrthogonal(), y = up.cross(x);
  ObjectOpening opening;
  opening.up = up;
  opening.floor = std::numeric_limits<double>::infinity();
  opening.rim = -opening.floor;
  std::vector<Vector3d> inside;
  int tried = 0;
  for (Eigen::Index i = 0; i < shape.points.cols(); i += kStride) {
    ++tried;
    Vector3d normal;
    shape.object.Distance(shape.points.col(i), &normal);
    if (normal.norm() < 0.3) continue;
    const Vector3d from = shape.points.col(i) + kOff * normal.normalized();
    if (shape.object.Distance(from) < 0.3 * kOff || Meets(shape.object, from, up, size)) continue;
    bool enclosed = true;
    for (int ray = 0; ray < kRays && enclosed; ++ray) {
      const double angle = 2.0 * std::numbers::pi * ray / kRays;
      enclosed = Meets(shape.object, from, std::cos(angle) * x + std::sin(angle) * y, size);
    }
    if (!enclosed) continue;
    inside.push_back(shape.points.col(i));
    const double height = up.dot(shape.points.col(i));
    opening.floor = std::min(opening.floor, height);
    opening.rim = std::max(opening.rim, height);
    opening.middle += shape.points.col(i);
  }
  if (inside.empty()) return {};
  opening.share = static_cast<double>(inside.size()) / tried;
  opening.middle /= static_cast<double>(inside.size());
  for (const Vector3d& point : inside) {
    const Vector3d apart = point - opening.middle;
    opening.radius = std::max(opening.radius, (apart - apart.dot(up) * up).norm());
  }
  return opening;
}

}  // namespace

ObjectOpening FindOpening(const ObjectShape& shape) {
  ObjectOpening best = OpeningTowards(shape, Vector3d::UnitZ());
  if (best.Any()) return best;
  best = {};
  for (const Matrix3d& axes : {Matrix3d(Matrix3d::Identity()), shape.axes}) {
    for (int k = 0; k < 6; ++k) {
      const ObjectOpening opening = OpeningTowards(shape, (k < 3 ? 1.0 : -1.0) * axes.col(k % 3));
      if (opening.Any() && opening.share > std::max(best.share, 0.18)) best = opening;
    }
  }
  return best;
}

}  // namespace holdfast
