// SPDX-License-Identifier: MIT
#include "geometry/render/visibility.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

using Polygon = std::vector<Eigen::Vector3d>;

// Sutherland-Hodgman: the part of the polygon with normal . x >= offset.
Polygon Cut(const Polygon& in, const Eigen::Vector3d& normal, double offset) {
  Polygon out;
  for (std::size_t k = 0; k < in.size(); ++k) {
    const Eigen::Vector3d& a = in[k];
    const Eigen::Vector3d& b = in[(k + 1) % in.size()];
    const double side_a = normal.dot(a) - offset;
    const double side_b = normal.dot(b) - offset;
    if (side_a >= 0.0) out.push_back(a);
    if ((side_a >= 0.0) != (side_b >= 0.0)) {
      out.push_back(a + side_a / (side_a - side_b) * (b - a));
    }
  }
  return out;
}

}  // namespace

VisibilityBuffer::VisibilityBuffer(const View& view)
    : view_(view),
      inverse_depth_(static_cast<std::size_t>(view.Width()) * view.Height(), 0.0f),
      id_(inverse_depth_.size(), kNothing) {}

void VisibilityBuffer::Draw(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& c, std::uint32_t id, bool translucent) {
  if (!a.allFinite() || !b.allFinite() || !c.allFinite()) return;
  const double near = view_.Near();
  if (a.z() < near && b.z() < near && c.z() < near) return;
  // Clip beyond the scanner's range: a guard band far outside the picture.
  const double slope = 0.5 * kScanLimit / view_.Focal();
  const auto inside = [&](const Eigen::Vector3d& p) {
    return p.z() >= near && std::abs(p.x()) <= slope * p.z() && std::abs(p.y()) <= slope * p.z();
  };
  if (inside(a) && inside(b) && inside(c)) {
    DrawClipped(a, b, c, id, translucent);
    return;
  }
  Polygon polygon = Cut({a, b, c}, Eigen::Vector3d::UnitZ(), near);
  polygon = Cut(polygon, {1.0, 0.0, slope}, 0.0);
  polygon = Cut(polygon, {-1.0, 0.0, slope}, 0.0);
  polygon = Cut(polygon, {0.0, 1.0, slope}, 0.0);
  polygon = Cut(polygon, {0.0, -1.0, slope}, 0.0);
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    DrawClipped(polygon[0], polygon[k - 1], polygon[k], id, translucent);
  }
}

void VisibilityBuffer::DrawClipped(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& c, std::uint32_t id, bool translucent) {
  // On the plane n . x = d a ray with z = 1 has 1/z = n . ray / d, which is linear in the pixel.
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double distance = normal.dot(a);
  if (distance == 0.0) return;  // no area, or exactly edge-on
  const Eigen::Vector3d plane = normal / distance;
  const double step_x = plane.x() / view_.Focal();
  const double step_y = plane.y() / view_.Focal();
  const double origin = plane.dot(view_.RayInCamera(0.5, 0.5));
  // Slivers extrapolate badly: depths are clamped to the range of the corners.
  const auto [min_z, max_z] = std::minmax({a.z(), b.z(), c.z()});
  const double low = 1.0 / max_z;
  const double high = 1.0 / min_z;
  ScanTriangle({view_.Project(a), view_.Project(b), view_.Project(c)}, view_.Width(),
               view_.Height(), [&](int x, int y) {
                 if (translucent && (x + y) % 2 != 0) return;
                 const auto inverse_depth =
                     static_cast<float>(std::clamp(origin + step_x * x + step_y * y, low, high));
                 const std::size_t at = Index(x, y);
                 if (inverse_depth > inverse_depth_[at]) {
                   inverse_depth_[at] = inverse_depth;
                   id_[at] = id;
                 }
               });
}

}  // namespace holdfast
