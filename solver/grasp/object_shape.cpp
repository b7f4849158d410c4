// SPDX-License-Identifier: MIT
#include "solver/grasp/object_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

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
    // Center of the bounding box along x and y (directions 0 and kWays / 2).
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
  // Direction orthogonal to `not_this` that most of the surface faces.
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

namespace {

// Whether a ray hits the object.
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

namespace {

constexpr double kThickestBar = 0.066;  // longer side of its cross-section
constexpr double kThinnestBar = 0.006;

// Longest run of slices that a hand closes around.
ObjectBar LongestRun(ShapeSlices slices) {
  ObjectBar bar;
  bar.slices = std::move(slices);
  const auto fits = [&](const ShapeSlice& slice) {
    return slice.count >= 4 && slice.wide < kThickestBar && slice.narrow > kThinnestBar &&
           slice.narrow < 0.052;
  };
  const int count = static_cast<int>(bar.slices.at.size());
  for (int first = 0; first < count;) {
    int last = first - 1;
    while (last + 1 < count && fits(bar.slices.at[last + 1])) ++last;
    if (last - first > bar.last - bar.first) {
      bar.first = first;
      bar.last = last;
    }
    first = last + 2;
  }
  return bar;
}

void MeasureBar(const ObjectShape& shape, ObjectBar& bar) {
  const ShapeSlices& slices = bar.slices;
  const int count = bar.last - bar.first + 1;
  for (int k = bar.first; k <= bar.last; ++k) {
    bar.line += slices.at[k].center / count;
    bar.wide += slices.at[k].wide / count;
  }
  bar.line -= bar.line.dot(slices.axis) * slices.axis;
  for (int k = bar.first; k <= bar.last; ++k) {
    const Vector3d& center = slices.at[k].center;
    const Vector3d apart = center - center.dot(slices.axis) * slices.axis - bar.line;
    bar.bend = std::max(bar.bend, apart.norm());
  }
  const AxisSpan run = bar.Run();
  bar.ends[0].length = run.low - slices.span.low;
  bar.ends[1].length = slices.span.high - run.high;
  for (Eigen::Index i = 0; i < shape.points.cols(); ++i) {
    const double s = slices.axis.dot(shape.points.col(i));
    if (s > run.low && s < run.high) continue;
    BeyondBar& end = bar.ends[s > run.low ? 1 : 0];
    const Vector3d apart = shape.points.col(i) - s * slices.axis - bar.line;
    end.off += apart;
    end.reach = std::max(end.reach, apart.norm());
    ++end.count;
  }
  for (BeyondBar& end : bar.ends) end.off /= std::max(1, end.count);
}

// Direction of the line through the slice centers of a run.
Vector3d LineOf(const ObjectBar& bar) {
  Matrix3Xd centers(3, bar.last - bar.first + 1);
  for (int k = bar.first; k <= bar.last; ++k) {
    centers.col(k - bar.first) = bar.slices.at[k].center;
  }
  const Matrix3Xd apart = centers.colwise() - centers.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(apart * apart.transpose());
  return eigen.eigenvectors().col(2);
}

}  // namespace

bool ObjectBar::Waist() const {
  return std::ranges::all_of(
      ends, [&](const BeyondBar& end) { return end.length > 0.02 && end.reach > 0.75 * wide; });
}

ObjectBar FindBar(const ObjectShape& shape) {
  constexpr int kDirections = 90, kSlices = 36;
  constexpr double kStraight = 0.966;
  ObjectBar best;
  double most = -1.0;
  const auto attempt = [&](const Vector3d& axis, bool anyway) {
    ObjectBar bar = LongestRun(CutIntoSlices(shape, axis, kSlices));
    if (bar.last - bar.first < 2) return;
    if (std::abs(LineOf(bar).dot(axis)) < kStraight) return;
    MeasureBar(shape, bar);
    const double worth = bar.Length() - bar.wide + (bar.Waist() ? 0.06 : 0.0);
    if (!anyway && worth <= most) return;
    most = worth;
    best = std::move(bar);
  };
  for (int k = 0; k < 3; ++k) attempt(shape.axes.col(k), false);
  for (int i = 0; i < kDirections; ++i) {
    const double z = (i + 0.5) / kDirections, r = std::sqrt(1.0 - z * z);
    const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    attempt({r * std::cos(angle), r * std::sin(angle), z}, false);
  }
  for (int round = 0; round < 2 && best.last > best.first; ++round) attempt(LineOf(best), true);
  return best;
}

}  // namespace holdfast
