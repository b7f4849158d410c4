// SPDX-License-Identifier: MIT
#include "geometry/mesh/convex_pieces.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/mesh/convex_hull.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

constexpr double kMinPiece_m3 = 1e-10;
constexpr double kSampleSpacing_m = 0.004;
constexpr double kCell_m = 0.0025;
constexpr double kJitter_m = 4e-6;
constexpr int kPlaces = 3;
constexpr std::size_t kMaxPieces = 48;

// A part of the surface (three columns per triangle) and its convex hull.
struct Part {
  Eigen::Matrix3Xd corners;
  TriangleMesh hull;
  double excess_m = 0.0;    // largest distance of the hull outside of the solid
  double outside_m3 = 0.0;  // excess integrated over the hull's surface
};

// Stops once more than `most_m3` is outside, and sets the volume to infinity then.
void MeasureExcess(const DistanceGrid& distance, double most_m3, Part& part) {
  const TriangleMesh& hull = part.hull;
  for (Eigen::Index f = 0; f < hull.NumFaces(); ++f) {
    if (part.outside_m3 > most_m3) {
      part.outside_m3 = std::numeric_limits<double>::infinity();
      return;
    }
    const Eigen::Vector3d a = hull.vertices.col(hull.faces(0, f));
    const Eigen::Vector3d ab = hull.vertices.col(hull.faces(1, f)) - a;
    const Eigen::Vector3d ac = hull.vertices.col(hull.faces(2, f)) - a;
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    const int n = std::max(1, static_cast<int>(std::ceil(longest / kSampleSpacing_m)));
    const double area = 0.5 * ab.cross(ac).norm() / (0.5 * n * (n + 1));
    for (int i = 0; i < n; ++i) {
      for (int k = 0; i + k < n; ++k) {
        const double d = distance.Distance(a + (i + 1.0 / 3.0) / n * ab + (k + 1.0 / 3.0) / n * ac);
        part.excess_m = std::max(part.excess_m, d);
        part.outside_m3 += std::max(0.0, d) * area;
      }
    }
  }
}

Part PartOf(Eigen::Matrix3Xd corners, const DistanceGrid& distance,
            double most_m3 = std::numeric_limits<double>::infinity()) {
  Part part;
  part.corners = std::move(corners);
  // Many coplanar points of a cut would force exact evaluation of the hull's predicates.
  part.hull = ConvexHullOfJittered(Jittered(DistinctPoints(part.corners), kJitter_m));
  MeasureExcess(distance, most_m3, part);
  return part;
}

// Clips the triangles to normal . x <= offset (Sutherland & Hodgman 1974).
Eigen::Matrix3Xd Below(const Eigen::Matrix3Xd& corners, const Eigen::Vector3d& normal,
                       double offset) {
  std::vector<Eigen::Vector3d> kept;
  for (Eigen::Index f = 0; f < corners.cols(); f += 3) {
    std::array<Eigen::Vector3d, 4> polygon;
    std::size_t count = 0;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = corners.col(f + k), q = corners.col(f + (k + 1) % 3);
      const double hp = normal.dot(p) - offset, hq = normal.dot(q) - offset;
      if (hp <= 0.0) polygon[count++] = p;
      if ((hp < 0.0 && hq > 0.0) || (hp > 0.0 && hq < 0.0)) {
        polygon[count++] = p + hp / (hp - hq) * (q - p);
      }
    }
    for (std::size_t k = 2; k < count; ++k) {
      kept.insert(kept.end(), {polygon[0], polygon[k - 1], polygon[k]});
    }
  }
  Eigen::Matrix3Xd out(3, kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i) out.col(static_cast<Eigen::Index>(i)) = kept[i];
  return out;
}

const std::array<Eigen::Vector3d, 9>& Directions() {
  static const std::array<Eigen::Vector3d, 9> directions = [] {
    std::array<Eigen::Vector3d, 9> made{Eigen::Vector3d(1, 0, 0),
                                        {0, 1, 0},
                                        {0, 0, 1},
                                        {1, 1, 0},
                                        {1, -1, 0},
                                        {1, 0, 1},
                                        {1, 0, -1},
                                        {0, 1, 1},
                                        {0, 1, -1}};
    for (Eigen::Vector3d& direction : made) direction.normalize();
    return made;
  }();
  return directions;
}

// Returns the two parts that leave the least outside the solid.
std::pair<Part, Part> Cut(const Part& part, const DistanceGrid& distance, int threads) {
  std::vector<std::pair<Part, Part>> tries(Directions().size() * kPlaces);
  // If one half alone exceeds the best total so far, the other half is not computed.
  std::atomic<double> least = std::numeric_limits<double>::infinity();
  ParallelFor(static_cast<int>(tries.size()), threads, [&](int k) {
    const Eigen::Vector3d& normal = Directions()[k / kPlaces];
    const Eigen::RowVectorXd heights = normal.transpose() * part.hull.vertices;
    const double low = heights.minCoeff(), high = heights.maxCoeff();
    const double offset = low + (k % kPlaces + 1.0) / (kPlaces + 1.0) * (high - low);
    auto& [below, above] = tries[k];
    below = PartOf(Below(part.corners, normal, offset), distance, least);
    if (below.outside_m3 > least) {
      above.outside_m3 = std::numeric_limits<double>::infinity();
      return;
    }
    // Slightly more than the remainder, since the sums are rounded.
    const double left = (1.0 + 1e-9) * least - below.outside_m3;
    above = PartOf(Below(part.corners, -normal, -offset), distance, left);
    const double outside = below.outside_m3 + above.outside_m3;
    for (double known = least; outside < known && !least.compare_exchange_weak(known, outside);) {
    }
  });
  const auto best = std::ranges::min_element(
      tries, {}, [](const auto& one) { return one.first.outside_m3 + one.second.outside_m3; });
  return std::move(*best);
}

}  // namespace

ConvexPieces SplitIntoConvexPieces(const TriangleMesh& mesh, const ConvexPieceOptions& options) {
  DecimateOptions fewer;
  fewer.vertices = options.vertices;
  fewer.samples = 0;
  const TriangleMesh solid =
      mesh.NumVertices() > options.vertices ? Decimate(mesh, fewer).mesh : mesh;
  DistanceGridOptions grid;
  grid.cell_m = kCell_m;
  grid.padding_m = 2.0 * kCell_m;  // hulls stay inside the box
  grid.threads = options.threads;
  const DistanceGrid distance(SignedDistance(solid), grid);
  std::vector<Part> parts = {PartOf(solid.vertices(Eigen::all, solid.faces.reshaped()), distance)};
  if (SignedVolume(parts[0].hull) < kMinPiece_m3) {
    throw Error("mesh", "spans no volume", "Give a solid");
  }
  while (parts.size() < kMaxPieces) {
    const auto worst = std::ranges::max_element(parts, {}, &Part::excess_m);
    if (worst->excess_m <= options.tolerance_m) break;
    auto [low, high] = Cut(*worst, distance, options.threads);
    *worst = std::move(low);
    parts.push_back(std::move(high));
  }
  ConvexPieces out;
  for (Part& part : parts) {
    if (SignedVolume(part.hull) < kMinPiece_m3) continue;
    out.excess_m = std::max(out.excess_m, part.excess_m);
    out.pieces.push_back(std::move(part.hull));
  }
  return out;
}

}  // namespace holdfast
