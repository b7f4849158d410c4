// SPDX-License-Identifier: MIT
#include "meshes/make/objects/curves.h"

#include <cassert>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

namespace holdfast::solids {
namespace {

/// Centripetal Catmull-Rom through four neighbours, Barry and Goldman's pyramid; rows beyond the
/// first `position_rows` ride along with the parameters of the positions.
Eigen::VectorXd CatmullRom(const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                           const Eigen::VectorXd& c, const Eigen::VectorXd& d, double t,
                           Eigen::Index position_rows) {
  const auto knot = [&](const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
    return std::sqrt(std::max((to - from).head(position_rows).norm(), 1e-9));
  };
  const double t1 = knot(a, b);
  const double t2 = t1 + knot(b, c);
  const double t3 = t2 + knot(c, d);
  const double u = t1 + t * (t2 - t1);
  const auto mix = [u](const Eigen::VectorXd& from, const Eigen::VectorXd& to, double t_from,
                       double t_to) -> Eigen::VectorXd {
    return ((t_to - u) * from + (u - t_from) * to) / (t_to - t_from);
  };
  const Eigen::VectorXd ab = mix(a, b, 0.0, t1);
  const Eigen::VectorXd bc = mix(b, c, t1, t2);
  const Eigen::VectorXd cd = mix(c, d, t2, t3);
  return mix(mix(ab, bc, 0.0, t2), mix(bc, cd, t1, t3), t1, t2);
}

/// Columns are control points; the curve runs from the first to the last.
Eigen::MatrixXd SampleSpline(const Eigen::MatrixXd& control, int steps,
                             Eigen::Index position_rows) {
  const Eigen::Index n = control.cols();
  assert(n >= 2);
  const auto point = [&](Eigen::Index i) -> Eigen::VectorXd {
    if (i < 0) return 2.0 * control.col(0) - control.col(1);
    if (i >= n) return 2.0 * control.col(n - 1) - control.col(n - 2);
    return control.col(i);
  };
  Eigen::MatrixXd curve(control.rows(), (n - 1) * steps + 1);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    for (int k = 0; k < steps; ++k) {
      curve.col(i * steps + k) = CatmullRom(point(i - 1), point(i), point(i + 1), point(i + 2),
                                            static_cast<double>(k) / steps, position_rows);
    }
  }
  curve.rightCols(1) = control.rightCols(1);
  return curve;
}

}  // namespace

Outline RoundedPath(const std::vector<Corner>& corners, bool closed, double degrees) {
  const int n = static_cast<int>(corners.size());
  Outline path;
  for (int i = 0; i < n; ++i) {
    const Vec2 corner(corners[i].x, corners[i].y);
    const bool is_end = !closed && (i == 0 || i == n - 1);
    if (is_end || corners[i].round <= 0.0) {
      path.push_back(corner);
      continue;
    }
    const Corner& before = corners[(i + n - 1) % n];
    const Corner& after = corners[(i + 1) % n];
    const Vec2 to_before = Vec2(before.x, before.y) - corner;
    const Vec2 to_after = Vec2(after.x, after.y) - corner;
    const Vec2 u = to_before.normalized();
    const Vec2 v = to_after.normalized();
    const double opening = std::acos(std::clamp(u.dot(v), -1.0, 1.0));
    const double turn = std::numbers::pi - opening;
    if (turn < 1e-6) {
      path.push_back(corner);
      continue;
    }
    // Neighbouring arcs share a straight piece, so each may take half of it.
    const double reach = std::min(corners[i].round / std::tan(0.5 * opening),
                                  0.4999 * std::min(to_before.norm(), to_after.norm()));
    const double radius = reach * std::tan(0.5 * opening);
    const Vec2 center = corner + (u + v).normalized() * radius / std::sin(0.5 * opening);
    const Vec2 from = corner + reach * u - center;
    const double sign = u.x() * v.y() - u.y() * v.x() > 0.0 ? -1.0 : 1.0;
    const int chords =
        std::max(2, static_cast<int>(std::ceil(turn * 180.0 / std::numbers::pi / degrees)));
    for (int k = 0; k <= chords; ++k) {
      path.push_back(center + Eigen::Rotation2Dd(sign * turn * k / chords) * from);
    }
  }
  return path;
}

Outline Spline(const std::vector<Vec2>& points, int steps) {
  Eigen::MatrixXd control(2, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) control.col(i) = points[i];
  const Eigen::MatrixXd curve = SampleSpline(control, steps, 2);
  Outline path(curve.cols());
  for (Eigen::Index i = 0; i < curve.cols(); ++i) path[i] = curve.col(i);
  return path;
}

Outline OffsetLeft(const Outline& path, double distance) {
  const int n = static_cast<int>(path.size());
  Outline moved(path.size());
  for (int i = 0; i < n; ++i) {
    const Vec2 tangent = (path[std::min(i + 1, n - 1)] - path[std::max(i - 1, 0)]).normalized();
    moved[i] = path[i] + distance * Vec2(-tangent.y(), tangent.x());
  }
  return moved;
}

Outline Mirrored(Outline half) {
  for (std::size_t k = half.size() - 1; k-- > 1;) half.emplace_back(-half[k].x(), half[k].y());
  return half;
}

Region::Region(Outline outline) : outline_(std::move(outline)) {
  outline_.push_back(outline_.front());
  constexpr std::size_t kEdges = 8;
  for (std::size_t begin = 0; begin + 1 < outline_.size(); begin += kEdges) {
    Stretch stretch{begin, std::min(begin + kEdges, outline_.size() - 1), Vec2::Zero(), 0.0};
    stretch.middle = 0.5 * (outline_[stretch.begin] + outline_[stretch.end]);
    for (std::size_t i = stretch.begin; i <= stretch.end; ++i) {
      stretch.radius = std::max(stretch.radius, (outline_[i] - stretch.middle).norm());
    }
    stretches_.push_back(stretch);
  }
}

double Region::operator()(const Vec2& p) const {
  double squared = std::numeric_limits<double>::infinity();
  bool inside = false;
  for (const Stretch& stretch : stretches_) {
    // A stretch matters when it may be nearest, or when a ray from p to the right may cross it.
    const double gap = (p - stretch.middle).norm() - stretch.radius;
    if (gap > 0.0 && gap * gap > squared && std::abs(p.y() - stretch.middle.y()) > stretch.radius) {
      continue;
    }
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
      const Vec2& a = outline_[i];
      const Vec2& b = outline_[i + 1];
      const Vec2 edge = b - a;
      const Vec2 to_p = p - a;
      const double t = std::clamp(to_p.dot(edge) / edge.squaredNorm(), 0.0, 1.0);
      squared = std::min(squared, (to_p - t * edge).squaredNorm());
      if ((a.y() > p.y()) != (b.y() > p.y()) && to_p.x() < edge.x() * to_p.y() / edge.y()) {
        inside = !inside;
      }
    }
  }
  return inside ? -std::sqrt(squared) : std::sqrt(squared);
}

Sweep::Sweep(const std::vector<Station>& stations, const Vec3& side, int steps)
    : side_(side.normalized()) {
  Eigen::MatrixXd control(5, stations.size());
  for (std::size_t i = 0; i < stations.size(); ++i) {
    control.col(i) << stations[i].center, stations[i].half_side, stations[i].half_up;
  }
  const Eigen::MatrixXd curve = SampleSpline(control, steps, 3);
  const Eigen::Index n = curve.cols();
  double length = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    centers_.push_back(curve.col(i).head<3>());
    halves_.push_back(curve.col(i).tail<2>());
    const Vec3 chord = curve.col(std::min(i + 1, n - 1)).head<3>() -
                       curve.col(std::max<Eigen::Index>(i - 1, 0)).head<3>();
    tangents_.push_back(chord.normalized());
    if (i > 0) length += (centers_[i] - centers_[i - 1]).norm();
    lengths_.push_back(length);
  }
  constexpr std::size_t kChords = 8;
  for (std::size_t begin = 0; begin + 1 < centers_.size(); begin += kChords) {
    Stretch stretch{begin, std::min(begin + kChords, centers_.size() - 1), Vec3::Zero(), 0.0};
    stretch.middle = 0.5 * (centers_[stretch.begin] + centers_[stretch.end]);
    for (std::size_t i = stretch.begin; i <= stretch.end; ++i) {
      stretch.radius = std::max(stretch.radius, (centers_[i] - stretch.middle).norm());
    }
    stretches_.push_back(stretch);
  }
}

Sweep::Place Sweep::Locate(const Vec3& p) const {
  std::size_t segment = 0;
  double fraction = 0.0;
  double best = std::numeric_limits<double>::infinity();
  for (const Stretch& stretch : stretches_) {
    const double gap = (p - stretch.middle).norm() - stretch.radius;
    if (gap > 0.0 && gap * gap > best) continue;
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
      const Vec3 chord = centers_[i + 1] - centers_[i];
      const double t = std::clamp((p - centers_[i]).dot(chord) / chord.squaredNorm(), 0.0, 1.0);
      const double squared = (p - centers_[i] - t * chord).squaredNorm();
      if (squared < best) {
        best = squared;
        segment = i;
        fraction = t;
      }
    }
  }
  const auto mix = [fraction](const auto& a, const auto& b) {
    return (a + fraction * (b - a)).eval();
  };
  const Vec3 center = mix(centers_[segment], centers_[segment + 1]);
  const Vec2 half = mix(halves_[segment], halves_[segment + 1]);
  const Vec3 tangent = mix(tangents_[segment], tangents_[segment + 1]).normalized();
  const Vec3 up = tangent.cross(side_).normalized();
  const Vec3 offset = p - center;
  const bool at_start = segment == 0 && fraction == 0.0;
  const bool at_end = segment + 2 == centers_.size() && fraction == 1.0;
  const double past = at_start ? std::max(-offset.dot(tangent), 0.0)
                      : at_end ? std::max(offset.dot(tangent), 0.0)
                               : 0.0;
  const double along =
      (lengths_[segment] + fraction * (lengths_[segment + 1] - lengths_[segment])) /
      lengths_.back();
  return {along, offset.dot(side_), offset.dot(up), past, half.x(), half.y()};
}

double Sweep::Distance(const Vec3& p, double exponent, double cap) const {
  const Place place = Locate(p);
  const auto power = [exponent](double x) { return std::pow(std::abs(x), exponent); };
  double sum = power(place.side / place.half_side) + power(place.up / place.half_up);
  if (cap > 0.0) sum += power(place.past / cap);
  const double section =
      (std::pow(sum, 1.0 / exponent) - 1.0) * std::min(place.half_side, place.half_up);
  if (cap > 0.0) return section;
  // Flat ends: the distance beyond either end plane, negative between the ends.
  const double ends = std::max((centers_.front() - p).dot(tangents_.front()),
                               (p - centers_.back()).dot(tangents_.back()));
  return std::max(section, ends);
}

}  // namespace holdfast::solids
