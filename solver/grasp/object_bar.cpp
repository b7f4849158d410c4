// SPDX-License-Identifier: MIT
#include "solver/grasp/object_bar.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Eigenvalues>

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kThickestBar = 0.066;  // its cross-section, its longer side
constexpr double kThinnestBar = 0.006;

// The longest run of slices that a hand closes around.
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

// The direction in which the middles of a run's slices follow each other.
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
