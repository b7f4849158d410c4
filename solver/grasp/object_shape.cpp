// SPDX-License-Identifier: MIT
#include "solver/grasp/object_shape.h"

#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/grasp/grasp_candidates.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr int kShapePoints = 3000;

}  // namespace

ObjectShape::ObjectShape(const TriangleMesh& its_mesh, const DistanceGrid& its_distance)
    : mesh(its_mesh),
      object(its_distance),
      points(SampleSurface(mesh, kShapePoints, 0)),
      middle(points.rowwise().mean()),
      centroid(SolidCentroid(mesh)) {
  const Matrix3Xd apart = points.colwise() - middle;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(apart * apart.transpose());
  axes = eigen.eigenvectors().rowwise().reverse();
}

AxisSpan ObjectShape::Along(const Vector3d& axis) const {
  const Eigen::RowVectorXd s = axis.transpose() * mesh.vertices;
  return {s.minCoeff(), s.maxCoeff()};
}

ShapeSlices CutIntoSlices(const ObjectShape& shape, const Vector3d& axis, int count) {
  constexpr int kWays = 8;
  ShapeSlices slices{axis, shape.Along(axis), std::vector<ShapeSlice>(count)};
  const Vector3d x = axis.unitOrthogonal(), y = axis.cross(x);
  Eigen::Matrix<double, kWays, 3> ways;
  for (int w = 0; w < kWays; ++w) {
    const double angle = std::numbers::pi * w / kWays;
    ways.row(w) = std::cos(angle) * x + std::sin(angle) * y;
  }
  const Eigen::Matrix<double, kWays, Eigen::Dynamic> across = ways * shape.points;
  const Eigen::RowVectorXd along = axis.transpose() * shape.points;
  using Widths = Eigen::Array<double, kWays, 1>;
  std::vector<Widths> low(count, Widths::Constant(1e9)), high(count, Widths::Constant(-1e9));
  for (Eigen::Index i = 0; i < shape.points.cols(); ++i) {
    const int k = slices.Of(along(i));
    low[k] = low[k].min(across.col(i).array());
    high[k] = high[k].max(across.col(i).array());
    ++slices.at[k].count;
  }
  for (int k = 0; k < count; ++k) {
    ShapeSlice& slice = slices.at[k];
    if (slice.count == 0) continue;
    slice.narrow = (high[k] - low[k]).minCoeff();
    slice.wide = (high[k] - low[k]).maxCoeff();
    // The middle of the box along x and y (ways 0 and kWays / 2).
    slice.center = 0.5 * (low[k](0) + high[k](0)) * x +
                   0.5 * (low[k](kWays / 2) + high[k](kWays / 2)) * y +
                   (slices.Low(k) + 0.5 * slices.Step()) * axis;
  }
  return slices;
}
ObjectBox FindBox(const ObjectShape& shape) {
  const TriangleMesh& mesh = shape.mesh;
  Matrix3Xd cross(3, mesh.NumFaces());
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) cross.col(f) = FaceCross(mesh, f);
  const Eigen::RowVectorXd area = cross.colwise().norm();
  // The direction that most of the surface faces, of those orthogonal to `not_this`.
  constexpr int kTried = 200;
  const auto dominant = [&](const Vector3d& not_this) {
    Vector3d best = Vector3d::Zero();
    double most = -1.0;
    const Eigen::Index stride = std::max<Eigen::Index>(1, mesh.NumFaces() / kTried);
    for (Eigen::Index f = 0; f < mesh.NumFaces(); f += stride) {
      Vector3d way = cross.col(f) - cross.col(f).dot(not_this) * not_this;
      if (!(way.norm() > 0.9 * area(f)) || !(area(f) > 0.0)) continue;
      way.normalize();
      const Eigen::RowVectorXd along = (way.transpose() * cross).cwiseAbs();
      const double facing = (along.array() > 0.97 * area.array()).select(area, 0.0).sum();
      if (facing > most) {
        most = facing;
        best = way;
      }
    }
    if (most < 0.0) return Vector3d(Vector3d::Zero());
    Vector3d mean = Vector3d::Zero();
    for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
      const double facing = best.dot(cross.col(f));
      if (std::abs(facing) > 0.97 * area(f)) mean += (facing > 0.0 ? 1.0 : -1.0) * cross.col(f);
    }
    mean -= mean.dot(not_this) * not_this;
    return Vector3d(mean.normalized());
  };
  ObjectBox box;
  const Vector3d first = dominant(Vector3d::Zero());
  const Vector3d second = dominant(first);
  if (!(second.norm() > 0.5)) return box;
  Matrix3d axes;
  axes << first, second, first.cross(second);
  std::array<int, 3> order = {0, 1, 2};
  std::array<AxisSpan, 3> spans;
  for (int k = 0; k < 3; ++k) spans[k] = shape.Along(axes.col(k));
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return spans[a].Length() > spans[b].Length(); });
  for (int k = 0; k < 3; ++k) {
    box.axes.col(k) = axes.col(order[k]);
    box.side[k] = spans[order[k]].Length();
  }
  double square = 0.0;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const double most = (axes.transpose() * cross.col(f)).cwiseAbs().maxCoeff();
    if (most > 0.94 * area(f)) square += area(f);
  }
  box.square = square / area.sum();
  constexpr int kCells = 9;
  int filled = 0;
  for (int i = 0; i < kCells * kCells * kCells; ++i) {
    const std::array<int, 3> cell = {i % kCells, i / kCells % kCells, i / (kCells * kCells)};
    Vector3d point = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      point += (spans[k].low + (cell[k] + 0.5) / kCells * spans[k].Length()) * axes.col(k);
    }
    filled += shape.object.Distance(point) < 0.0;
  }
  box.filled = filled / static_cast<double>(kCells * kCells * kCells);
  return box;
}

double Roundness(const ObjectShape& shape, const Vector3d& axis, const Vector3d& middle) {
  constexpr int kStride = 8;
  const double near = std::max(0.0015, 0.02 * Extent(shape.mesh).norm());
  int sides = 0, kept = 0;
  for (const double degrees : {37.0, 90.0, 151.0, 222.0, 305.0}) {
    const Matrix3d turn = ExpSO3(degrees * kDegree * axis);
    for (Eigen::Index i = 0; i < shape.points.cols(); i += kStride) {
      Vector3d normal;
      shape.object.Distance(shape.points.col(i), &normal);
      if (std::abs(normal.dot(axis)) > 0.9 * normal.norm()) continue;
      ++sides;
      kept +=
          std::abs(shape.object.Distance(middle + turn * (shape.points.col(i) - middle))) < near;
    }
  }
  return sides == 0 ? 0.0 : kept / static_cast<double>(sides);
}

bool IsBall(const ObjectShape& shape) {
  const Eigen::RowVectorXd far = (shape.points.colwise() - shape.middle).colwise().norm();
  const double mean = far.mean();
  return std::sqrt((far.array() - mean).square().mean()) < 0.13 * mean;
}

}  // namespace holdfast
