// SPDX-License-Identifier: MIT
#include "geometry/score/contact_metrics.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/half_edges.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/parallel.h"
#include "geometry/score/clipped_volume.h"

namespace holdfast {
namespace {

using Cubes = Eigen::Matrix<long long, 3, 1>;  ///< grid coordinates

/// Counts cubes whose centers are inside two solids. Blocks of cubes are halved until a block's
/// center is farther from a surface than from its own corner cubes: the whole block is then on one
/// side, as distance is 1-Lipschitz. The count equals that of testing every cube.
class SharedCubes {
 public:
  /// Bounding box and plane of a triangle.
  struct Face {
    Eigen::AlignedBox3d box;
    Eigen::Vector3d normal;  // not normalized
    double offset;

    explicit Face(const Eigen::Matrix3d& corners)
        : box(corners.rowwise().minCoeff(), corners.rowwise().maxCoeff()),
          normal((corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0))),
          offset(normal.dot(corners.col(0))) {}

    /// Conservative test whether the face intersects the cube, with a margin for rounding.
    bool MayMeet(const Eigen::Vector3d& center, double half_edge) const {
      constexpr double kRounding_m = 1e-9;
      const double reach = half_edge + kRounding_m;
      return ((box.min() - center).array() <= reach).all() &&
             ((center - box.max()).array() <= reach).all() &&
             std::abs(normal.dot(center) - offset) <= reach * normal.lpNorm<1>();
    }
  };
  using Faces = std::vector<Face>;

  SharedCubes(const SignedDistance& a, const SignedDistance& b, double voxel,
              const Eigen::AlignedBox3d& box)
      : solids_{&a, &b}, voxel_(voxel), box_(box) {
    // Test the watertight solid first: its side test is cheap.
    if (!a.IsWatertight()) std::swap(solids_[0], solids_[1]);
  }

  /// Counts cubes [low, low + size) per axis, `size` a power of two. No point outside the box is
  /// inside both. `faces`, if known: at least those faces bounding the intersection that reach this
  /// block.
  long long Count(const Cubes& low, long long size, bool in_a, bool in_b, const Faces* faces) {
    const Eigen::Vector3d center =
        voxel_ * (low.cast<double>().array() + 0.5 * static_cast<double>(size)).matrix();
    const double half_edge = 0.5 * voxel_ * static_cast<double>(size - 1);
    if (((center.array() + half_edge) < box_.min().array()).any() ||
        ((center.array() - half_edge) > box_.max().array()).any()) {
      return 0;
    }
    Faces faces_here;
    if (faces != nullptr && size > 1) {
      std::ranges::copy_if(*faces, std::back_inserter(faces_here),
                           [&](const Face& face) { return face.MayMeet(center, half_edge); });
      faces = &faces_here;
    }
    // Without a face between, all cubes are on one side.
    const bool alike = faces != nullptr && faces->empty();
    const double reach = alike ? 0.0 : std::sqrt(3.0) * half_edge;
    bool inside[2] = {in_a, in_b};
    for (int s = 0; s < 2; ++s) {
      if (inside[s]) continue;
      // The side is only needed if no surface can be in between. Testing the side is most of the
      // work for an open surface.
      const TriangleTree::Hit nearest = solids_[s]->Tree().Closest(center, hints_[s]);
      hints_[s] = nearest.face;
      if (nearest.squared_distance < reach * reach) continue;
      if (!solids_[s]->Inside(center, nearest)) return 0;
      inside[s] = true;
    }
    if (inside[0] && inside[1]) return size * size * size;
    const long long half = size / 2;
    long long count = 0;
    for (int child = 0; child < 8; ++child) {
      const Cubes offset(child & 1, (child >> 1) & 1, (child >> 2) & 1);
      count += Count(low + half * offset, half, inside[0], inside[1], faces);
    }
    return count;
  }

 private:
  const SignedDistance* solids_[2];
  double voxel_;
  Eigen::AlignedBox3d box_;
  int hints_[2] = {-1, -1};
};

}  // namespace

ContactMetrics ContactFromDistances(const Eigen::VectorXd& distances_m,
                                    const ContactProtocol& protocol) {
  const Eigen::Index n = distances_m.size();
  if (n == 0) throw Error("hand", "has no vertices", "Give the hand's vertices");
  ContactMetrics metrics;
  const Eigen::VectorXd distances_mm = 1e3 * distances_m;
  Eigen::Index inside = 0;
  Eigen::Index in_contact = 0;
  for (const double d : distances_mm) {
    if (d < 0.0) {
      ++inside;
      metrics.max_penetration_mm = std::max(metrics.max_penetration_mm, -d);
      metrics.mean_penetration_mm -= d;
    }
    in_contact += std::abs(d) < protocol.contact_threshold_mm;
  }
  if (inside > 0) metrics.mean_penetration_mm /= static_cast<double>(inside);
  metrics.penetrating_ratio = static_cast<double>(inside) / static_cast<double>(n);
  metrics.contact_ratio = static_cast<double>(in_contact) / static_cast<double>(n);
  metrics.in_contact = in_contact > 0 || inside > 0;
  metrics.min_distance_mm = distances_mm.minCoeff();
  return metrics;
}

ContactMetrics MeasureContact(const TriangleMesh& hand_in_object, const SignedDistance& object,
                              const ContactProtocol& protocol) {
  ContactMetrics metrics =
      ContactFromDistances(object.Distances(hand_in_object.vertices, protocol.threads), protocol);
  const SignedDistance hand(CloseHoles(hand_in_object));
  metrics.intersection_volume_cm3 =
      1e6 * IntersectionVolume(object, hand, 1e-3 * protocol.voxel_mm, protocol.threads);
  return metrics;
}

TriangleMesh CloseHoles(const TriangleMesh& mesh) {
  const HoleFill fill(mesh);
  return {fill.Vertices(mesh.vertices), fill.Faces()};
}

HoleFill::HoleFill(const TriangleMesh& mesh) {
  RequireValid(mesh);
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    if (HasRepeatedCorner(mesh.faces.col(f))) {
      throw Error("mesh", fmt::format("face {} repeats a corner", f), "Repair the mesh first");
    }
  }
  // Duplicated vertices where fans touch are labeled with the ids of their sources.
  const int given = static_cast<int>(mesh.NumVertices());
  TriangleMesh parted{Eigen::Matrix3Xd::Zero(3, given), mesh.faces};
  for (int v = 0; v < given; ++v) parted.vertices(0, v) = v;
  PartTouchingFans(parted);
  const auto source = [&](int v) { return static_cast<int>(parted.vertices(0, v)); };
  const int all = static_cast<int>(parted.NumVertices());
  for (int v = given; v < all; ++v) added_.push_back({source(v)});
  faces_ = parted.faces;
  const HalfEdges edges({Eigen::Matrix3Xd::Zero(3, all), faces_});
  if (edges.NumApart() > 0) {
    throw Error("mesh",
                "has an edge of more than two faces, or of two faces with opposite orientation",
                "Repair the mesh first");
  }
  std::vector<Eigen::Vector3i> caps;
  for (const std::vector<int>& loop : edges.BoundaryLoops()) {
    const int tip = given + static_cast<int>(added_.size());
    std::vector<int>& rim = added_.emplace_back();
    for (std::size_t k = 0; k < loop.size(); ++k) {
      rim.push_back(source(loop[k]));
      caps.emplace_back(loop[(k + 1) % loop.size()], loop[k], tip);
    }
  }
  const Eigen::Index own = faces_.cols();
  faces_.conservativeResize(Eigen::NoChange, own + static_cast<Eigen::Index>(caps.size()));
  for (std::size_t k = 0; k < caps.size(); ++k) {
    faces_.col(own + static_cast<Eigen::Index>(k)) = caps[k];
  }
}

Eigen::Matrix3Xd HoleFill::Vertices(const Eigen::Matrix3Xd& vertices) const {
  Eigen::Matrix3Xd all(3, vertices.cols() + static_cast<Eigen::Index>(added_.size()));
  all.leftCols(vertices.cols()) = vertices;
  Eigen::Index next = vertices.cols();
  for (const std::vector<int>& from : added_) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int v : from) sum += vertices.col(v);
    all.col(next++) = sum / static_cast<double>(from.size());
  }
  return all;
}

namespace {

double CountedVolume(const SignedDistance& a, const SignedDistance& b, double voxel_m,
                     const Eigen::AlignedBox3d& box, const SharedCubes::Faces* faces, int threads) {
  if (!(voxel_m > 0.0)) throw Error("voxel", "must be positive", "Use 2 mm, for example");
  const Eigen::Vector3d low = a.Min().cwiseMax(b.Min()).cwiseMax(box.min());
  const Eigen::Vector3d high = a.Max().cwiseMin(b.Max()).cwiseMin(box.max());
  if ((low.array() >= high.array()).any()) return 0.0;
  constexpr long long kBlock = 8;
  const auto block_of = [&](double coordinate) {
    return static_cast<long long>(std::floor(coordinate / (voxel_m * static_cast<double>(kBlock))));
  };
  const auto count_layer = [&](long long z) {
    SharedCubes cubes(a, b, voxel_m, {low, high});
    long long count = 0;
    for (long long y = block_of(low.y()); y <= block_of(high.y()); ++y) {
      for (long long x = block_of(low.x()); x <= block_of(high.x()); ++x) {
        count += cubes.Count(kBlock * Cubes(x, y, z), kBlock, false, false, faces);
      }
    }
    return count;
  };
  // Counts are integers: the sum does not depend on the order.
  const long long first_layer = block_of(low.z());
  std::atomic<long long> count = 0;
  ParallelFor(static_cast<int>(block_of(high.z()) - first_layer + 1), threads,
              [&](int layer) { count += count_layer(first_layer + layer); });
  return static_cast<double>(count.load()) * voxel_m * voxel_m * voxel_m;
}

}  // namespace

double IntersectionVolume(const SignedDistance& a, const SignedDistance& b, double voxel_m,
                          int threads) {
  return CountedVolume(a, b, voxel_m, {a.Min(), a.Max()}, nullptr, threads);
}

double IntersectionVolume(const Solid& a, const Solid& b, const SolidOverlap& overlap,
                          double voxel_m) {
  if (overlap.box.isEmpty()) return 0.0;
  SharedCubes::Faces faces;
  const auto add = [&](const TriangleMesh& mesh, const std::vector<int>& ids) {
    for (const int face : ids) {
      faces.emplace_back(Eigen::Matrix3d(mesh.vertices(Eigen::all, mesh.faces.col(face))));
    }
  };
  add(a.mesh, overlap.faces_a);
  add(b.mesh, overlap.faces_b);
  return CountedVolume(a.distance, b.distance, voxel_m, overlap.box, &faces, 1);
}

}  // namespace holdfast
