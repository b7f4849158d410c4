// SPDX-License-Identifier: MIT
#include "geometry/mesh/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/Geometry>

#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/mesh/triangle_tree.h"
#include "geometry/mesh/winding_number.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

// Closer to the surface than this share of the mesh's size, the direction to the closest point is
// rounding noise and the pseudonormal is the better gradient.
constexpr double kOnSurface = 1e-12;

int CornerOfEdge(TriangleFeature feature) {
  switch (feature) {
    case TriangleFeature::kEdge01:
      return 0;
    case TriangleFeature::kEdge12:
      return 1;
    default:
      return 2;
  }
}

}  // namespace

struct SignedDistance::Impl {
  explicit Impl(const TriangleMesh& mesh)
      : tree(mesh),
        faces(mesh.faces),
        face_normals(3, mesh.NumFaces()),
        edge_normals(3, 3 * mesh.NumFaces()),
        vertex_normals(VertexNormals(mesh)),
        surface_tolerance(kOnSurface * (tree.Max() - tree.Min()).norm()) {
    for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
      face_normals.col(f) = FaceCross(mesh, f).stableNormalized();
    }
    SumEdgeNormals();
    if (CheckMesh(mesh).watertight) {
      sign = Sign::kPseudonormal;
    } else {
      sign = Sign::kWindingNumber;
      winding = std::make_unique<WindingNumber>(mesh);
    }
  }

  /// The sum of the normals of all faces at an edge, whichever way each face runs through it.
  void SumEdgeNormals() {
    EdgeTable(faces, vertex_normals.cols()).ForEach([&](int, int, std::span<const int> sides) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const int side : sides) sum += face_normals.col(side / 3);
      sum.stableNormalize();
      for (const int side : sides) edge_normals.col(side) = sum;
    });
  }

  Eigen::Vector3d Pseudonormal(const TriangleTree::Hit& hit) const {
    switch (hit.feature) {
      case TriangleFeature::kFace:
        return face_normals.col(hit.face);
      case TriangleFeature::kVertex0:
      case TriangleFeature::kVertex1:
      case TriangleFeature::kVertex2: {
        const int corner =
            static_cast<int>(hit.feature) - static_cast<int>(TriangleFeature::kVertex0);
        return vertex_normals.col(faces(corner, hit.face));
      }
      default:
        return edge_normals.col(3 * hit.face + CornerOfEdge(hit.feature));
    }
  }

  double Signed(const Eigen::Vector3d& point, const TriangleTree::Hit& hit) const {
    const double distance = std::sqrt(hit.squared_distance);
    const bool inside = sign == Sign::kPseudonormal
                            ? (point - hit.point).dot(Pseudonormal(hit)) < 0.0
                            : distance > 0.0 && winding->At(point) > 0.5;
    return inside ? -distance : distance;
  }

  TriangleTree tree;
  Eigen::Matrix3Xi faces;
  Eigen::Matrix3Xd face_normals;
  Eigen::Matrix3Xd edge_normals;  // column 3 f + k: of the edge from corner k to k + 1 of face f
  Eigen::Matrix3Xd vertex_normals;
  double surface_tolerance;
  Sign sign = Sign::kPseudonormal;
  std::unique_ptr<WindingNumber> winding;  // only without a watertight mesh
};

SignedDistance::SignedDistance(const TriangleMesh& mesh)
    : impl_(std::make_unique<const Impl>(mesh)) {}
SignedDistance::~SignedDistance() = default;
SignedDistance::SignedDistance(SignedDistance&&) noexcept = default;
SignedDistance& SignedDistance::operator=(SignedDistance&&) noexcept = default;

SignedDistance::Sign SignedDistance::SignMethod() const { return impl_->sign; }
const Eigen::Vector3d& SignedDistance::Min() const { return impl_->tree.Min(); }
const Eigen::Vector3d& SignedDistance::Max() const { return impl_->tree.Max(); }

double SignedDistance::Distance(const Eigen::Vector3d& point) const {
  return impl_->Signed(point, impl_->tree.Closest(point));
}

SignedDistance::Result SignedDistance::Query(const Eigen::Vector3d& point) const {
  const TriangleTree::Hit hit = impl_->tree.Closest(point);
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
  // Fixed blocks, each searched in order: what a hint says does not depend on which thread takes
  // which block, and so the bytes do not either.
  constexpr Eigen::Index kBlock = 1024;
  const auto block = [&](Eigen::Index begin) {
    TriangleTree::Hit last;
    const Eigen::Index end = std::min(begin + kBlock, points.cols());
    for (Eigen::Index i = begin; i < end; ++i) {
      const Eigen::Vector3d point = points.col(i);
      // The last face is a good start for a step that is short beside the distance, as on a grid,
      // and a poor one otherwise.
      const bool near_last =
          i > begin && 16.0 * (point - points.col(i - 1)).squaredNorm() < last.squared_distance;
      last = impl_->tree.Closest(point, near_last ? last.face : -1);
      distances[i] = impl_->Signed(point, last);
    }
  };
  const Eigen::Index num_blocks = (points.cols() + kBlock - 1) / kBlock;
  ParallelFor(static_cast<int>(num_blocks), threads, [&](int b) { block(b * kBlock); });
  return distances;
}

}  // namespace holdfast
