// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_candidates.h"
#include "geometry/seed.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

// Fractional steps of the R3 sequence (Roberts 2018): 1/g, 1/g^2, 1/g^3 with g^4 = g + 1.
constexpr double kStep[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};

double Fraction(double x) { return x - std::floor(x); }

// Offset of the sequences in [0, 1), from the seed.
double Shift(std::uint64_t seed, int dimension) {
  return static_cast<double>(MixSeed(seed, static_cast<std::uint64_t>(dimension)) >> 11) *
         0x1.0p-53;
}

// 1 for widths that a hand grasps comfortably; less near the limits of its span.
double WidthQuality(double width, double max_width) {
  const double wide = std::clamp((max_width - width) / (0.35 * max_width), 0.15, 1.0);
  const double thin = std::clamp(width / 0.012, 0.35, 1.0);
  return wide * thin;
}

bool SameNeighborhood(const Opposition& a, const Opposition& b, double size) {
  const double near = std::clamp(0.12 * size, 0.008, 0.02);
  return (a.center - b.center).norm() < near && std::abs(a.axis.dot(b.axis)) > 0.92 &&
         std::abs(a.width - b.width) < 0.015;
}

// As many allowed points as requested, or all among a much larger sample.
Eigen::Matrix3Xd AllowedPoints(const TriangleMesh& object, const OppositionOptions& options) {
  if (!options.allowed) return SampleSurface(object, options.samples, options.seed);
  constexpr int kMore = 30;
  Eigen::Matrix3Xd points = SampleSurface(object, kMore * options.samples, options.seed);
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < points.cols() && count < options.samples; ++i) {
    if (options.allowed(points.col(i))) points.col(count++) = points.col(i).eval();
  }
  return points.leftCols(count);
}

}  // namespace

std::optional<InwardRay> MeasureThickness(const TriangleMesh& object, const TriangleTree& tree,
                                          const Eigen::Vector3d& place, double most_m) {
  constexpr double kTouch_m = 0.00025, kOwnSurface_m = 0.001, kFacing = 0.5;
  const auto normal_of = [&](int face) -> Eigen::Vector3d {
    return FaceCross(object, face).normalized();
  };
  TriangleTree::Hit hit = tree.Closest(place);
  const InwardRay ray{hit.point, -normal_of(hit.face), 0.0};
  for (double s = kTouch_m; s < most_m;) {
    hit = tree.Closest(ray.start + s * ray.inward, hit.face);
    const double distance = std::sqrt(hit.squared_distance);
    const double facing = normal_of(hit.face).dot(ray.inward);
    // Face orientation may be inverted; the face that the ray left is not met again.
    if (distance < kTouch_m && (facing > kFacing || (s > kOwnSurface_m && facing < -kFacing))) {
      return InwardRay{ray.start, ray.inward, s};
    }
    s += std::max(distance, kTouch_m);
  }
  return std::nullopt;
}

bool IsWithinSpan(const TriangleMesh& object, double span_m) {
  constexpr int kPlaces = 3000;
  const TriangleTree tree(object);
  const Eigen::Matrix3Xd places = SampleSurface(object, kPlaces, 0);
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    if (MeasureThickness(object, tree, places.col(i), span_m)) return true;
  }
  return false;
}

Eigen::Vector3d SolidCentroid(const TriangleMesh& mesh) {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero(), surface_moment = Eigen::Vector3d::Zero();
  double volume = 0.0, area = 0.0;
  const Eigen::Vector3d origin = mesh.vertices.rowwise().mean();
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, f)) - origin;
    const Eigen::Vector3d b = mesh.vertices.col(mesh.faces(1, f)) - origin;
    const Eigen::Vector3d c = mesh.vertices.col(mesh.faces(2, f)) - origin;
    const double tetrahedron = a.dot(b.cross(c)) / 6.0;
    volume += tetrahedron;
    moment += tetrahedron * 0.25 * (a + b + c);
    const double triangle = 0.5 * (b - a).cross(c - a).norm();
    area += triangle;
    surface_moment += triangle / 3.0 * (a + b + c);
  }
  const Eigen::AlignedBox3d box(mesh.vertices.rowwise().minCoeff(),
                                mesh.vertices.rowwise().maxCoeff());
  if (volume > 1e-3 * box.volume()) {
    const Eigen::Vector3d centroid = origin + moment / volume;
    if (box.contains(centroid)) return centroid;
  }
  return area > 0.0 ? Eigen::Vector3d(origin + surface_moment / area) : origin;
}

Eigen::Matrix3Xd SampleSurface(const TriangleMesh& mesh, int count, std::uint64_t seed) {
  std::vector<double> cumulative(mesh.NumFaces() + 1, 0.0);
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    cumulative[f + 1] = cumulative[f] + 0.5 * FaceCross(mesh, f).norm();
  }
  Eigen::Matrix3Xd points(3, count);
  for (int i = 0; i < count; ++i) {
    const double target = Fraction(Shift(seed, 0) + i * kStep[0]) * cumulative.back();
    const auto it = std::upper_bound(cumulative.begin(), cumulative.end(), target);
    const Eigen::Index f =
        std::clamp<Eigen::Index>(it - cumulative.begin() - 1, 0, mesh.NumFaces() - 1);
    double u = Fraction(Shift(seed, 1) + i * kStep[1]);
    double v = Fraction(Shift(seed, 2) + i * kStep[2]);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    points.col(i) = (1.0 - u - v) * mesh.vertices.col(mesh.faces(0, f)) +
                    u * mesh.vertices.col(mesh.faces(1, f)) +
                    v * mesh.vertices.col(mesh.faces(2, f));
  }
  return points;
}

std::vector<Opposition> FindOppositions(const TriangleMesh& object, const DistanceGrid& distance,
                                        const Eigen::Vector3d& centroid,
                                        const OppositionOptions& options) {
  const Eigen::Matrix3Xd points = AllowedPoints(object, options);
  const double size = Extent(object).norm();
  const double min_step = 0.25 * distance.CellSize();

  std::vector<Opposition> found;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    Eigen::Vector3d normal;
    distance.Distance(points.col(i), &normal);
    if (normal.norm() < 0.5) continue;  // a crease or the middle of a thin wall: no direction
    normal.normalize();
    const Eigen::Vector3d start = points.col(i);
    bool inside = true;
    for (double s = 2.0 * min_step; s < options.max_width_m;) {
      Eigen::Vector3d gradient;
      const double d = distance.Distance(start - s * normal, &gradient);
      if (inside && d > 0.0) {
        const double cosine = -gradient.normalized().dot(normal);
        const double width = s - d;
        if (cosine > options.min_normal_cosine &&
            (!options.allowed || options.allowed(start - width * normal))) {
          const Eigen::Vector3d center = start - 0.5 * width * normal;
          const double off_center = (center - centroid).norm() / size;
          found.push_back(
              {center, -normal, width,
               cosine * WidthQuality(width, options.max_width_m) * std::exp(-1.5 * off_center)});
          if (options.weight) found.back().quality *= options.weight(found.back());
        }
      }
      inside = d < 0.0;
      s += std::max(std::abs(d), min_step);
    }
  }

  std::ranges::stable_sort(found, std::greater(), &Opposition::quality);
  std::vector<Opposition> kept;
  for (const Opposition& opposition : found) {
    if (static_cast<int>(kept.size()) == options.count) break;
    const bool is_new = std::ranges::none_of(
        kept, [&](const Opposition& other) { return SameNeighborhood(opposition, other, size); });
    if (is_new) kept.push_back(opposition);
  }
  return kept;
}

}  // namespace holdfast
