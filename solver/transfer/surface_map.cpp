// SPDX-License-Identifier: MIT
#include "solver/transfer/surface_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/transfer/map_finder.h"

namespace holdfast {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

Vector3d SurfaceMap::Warp(const Vector3d& point) const {
  const Vector3d placed = Placed(point);
  if (nodes_.empty()) return placed;
  const NodeWeights near = WeightsAt(nodes_, placed);
  Vector3d bent = Vector3d::Zero();
  for (int k = 0; k < kNodesOfPoint; ++k) {
    const DeformationNode& node = nodes_[near.node[k]];
    bent += near.weight[k] * (node.turn * (placed - node.at) + node.at + node.shift);
  }
  return bent;
}

Matrix3d SurfaceMap::Turn(const Vector3d& point) const {
  if (nodes_.empty()) return rotation_;
  const NodeWeights near = WeightsAt(nodes_, Placed(point));
  Matrix3d turn = Matrix3d::Zero();
  for (int k = 0; k < kNodesOfPoint; ++k) turn += near.weight[k] * nodes_[near.node[k]].turn;
  return NearestRotation(turn * rotation_);
}

SurfaceMap::Image SurfaceMap::At(const Vector3d& point, const Vector3d& normal) const {
  if (!to_) {  // scaled: exact
    return {Placed(point),
            (rotation_ * report_.scale.cwiseInverse().asDiagonal() * normal).normalized()};
  }
  // Query from slightly outside, so that the near side of a thin wall is the nearest.
  constexpr double kOutside_m = 0.003;
  const Vector3d outwards =
      (Turn(point) * report_.scale.cwiseInverse().asDiagonal() * normal).normalized();
  const SignedDistance::Result hit = to_->Query(Warp(point) + kOutside_m * outwards);
  const SignedDistance::Result there = to_->Query(hit.closest);
  return {hit.closest, there.gradient.norm() > 0.5 ? there.gradient.normalized() : outwards};
}

void SurfaceMap::Measure(const TriangleMesh& from, const TriangleMesh& to) {
  constexpr int kPoints = 600, kStretched = 200;
  const SignedDistance surface(from);
  const OrientedPoints points = SampleOriented(from, surface, kPoints);
  Matrix3Xd carried(3, points.Count());
  double squares = 0.0;
  for (Eigen::Index i = 0; i < points.Count(); ++i) {
    carried.col(i) = Warp(points.at.col(i));
    squares += std::pow(to_->Query(carried.col(i)).distance, 2);
  }
  report_.residual_mm = 1e3 * std::sqrt(squares / static_cast<double>(points.Count()));
  TriangleMesh warped = from;
  for (auto vertex : warped.vertices.colwise()) vertex = Warp(vertex);
  const TriangleTree tree(warped);
  const Matrix3Xd others = SampleSurface(to, kPoints);
  std::vector<double> missed;
  for (Eigen::Index i = 0; i < others.cols(); ++i) {
    missed.push_back(std::sqrt(tree.Closest(others.col(i)).squared_distance));
  }
  std::ranges::sort(missed);
  report_.missed_mm = 1e3 * missed[missed.size() * 95 / 100];

  const double step = 0.02 * BoxOf(from.vertices).diagonal().norm();
  std::vector<double> stretch;
  double uniform = 0.0;
  for (Eigen::Index i = 0; i < points.Count(); i += kPoints / kStretched) {
    const Vector3d n = points.normal.col(i);
    const Vector3d u = n.unitOrthogonal(), v = n.cross(u);
    Eigen::Matrix<double, 3, 2> gradient;
    for (int k = 0; k < 2; ++k) {
      const Vector3d off = 0.5 * step * (k == 0 ? u : v);
      gradient.col(k) = (Warp(points.at.col(i) + off) - Warp(points.at.col(i) - off)) / step;
    }
    const Eigen::Vector2d squared =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(gradient.transpose() * gradient)
            .eigenvalues();
    for (const double s : {std::sqrt(std::max(1e-6, squared(0))), std::sqrt(squared(1))}) {
      stretch.push_back(std::log(std::max(1e-3, s)));
      uniform += stretch.back();
    }
  }
  uniform /= static_cast<double>(stretch.size());
  const auto ranked = [&](double offset, std::size_t percent) {
    std::vector<double> sizes;
    for (const double s : stretch) sizes.push_back(std::exp(std::abs(s - offset)));
    std::ranges::sort(sizes);
    return sizes[std::min(sizes.size() - 1, sizes.size() * percent / 100)];
  };
  report_.stretch_median = ranked(0.0, 50);
  report_.stretch_most = ranked(0.0, 95);
  const double size_mm = 1e3 * BoxOf(to.vertices).diagonal().norm();
  report_.alike = report_.residual_mm < 0.04 * size_mm && report_.missed_mm < 0.08 * size_mm &&
                  ranked(uniform, 95) < 2.5;

  SetInPlace(from, to.vertices);
}

// Same orientation, box centers vertically aligned, lowest points level.
void SurfaceMap::SetInPlace(const TriangleMesh& from, const Matrix3Xd& to) {
  const Eigen::AlignedBox3d a = BoxOf(from.vertices), b = BoxOf(rotation_.transpose() * to);
  Vector3d shift = b.center() - a.center();
  shift.z() = b.min().z() - a.min().z();
  to_from_from_ = RigidTransform(rotation_, rotation_ * shift);
}

SurfaceMap SurfaceMap::Scaled(const TriangleMesh& from, const Vector3d& factors) {
  if (!factors.allFinite() || (factors.array() < 0.05).any() || (factors.array() > 20.0).any()) {
    throw Error("scale", fmt::format("is {:g}, {:g}, {:g}", factors.x(), factors.y(), factors.z()),
                "Give one factor, or one for each axis, between 0.05 and 20");
  }
  SurfaceMap map;
  map.linear_ = factors.asDiagonal();
  map.report_.scale = factors;
  Vector3d stretch = factors.cwiseMax(factors.cwiseInverse());
  std::ranges::sort(stretch);
  map.report_.stretch_median = stretch(1);
  map.report_.stretch_most = stretch(2);
  map.SetInPlace(from, factors.asDiagonal() * from.vertices);
  return map;
}

SurfaceMap SurfaceMap::Registered(const TriangleMesh& from, const TriangleMesh& to) {
  SurfaceMap map = MapFinder(from, to).ByShape();
  map.Measure(from, to);
  return map;
}

SurfaceMap SurfaceMap::Given(const TriangleMesh& from, const TriangleMesh& to,
                             const Matrix3Xd& on_from, const Matrix3Xd& on_to) {
  if (on_from.cols() != on_to.cols() || on_from.cols() < 4) {
    throw Error("map",
                fmt::format("has {} points on the first object and {} on the second",
                            on_from.cols(), on_to.cols()),
                "Give at least four pairs of points");
  }
  constexpr double kFarthest_m = 0.02;
  const std::pair<const TriangleMesh*, const Matrix3Xd*> sides[] = {{&from, &on_from},
                                                                    {&to, &on_to}};
  for (const auto& [mesh, points] : sides) {
    const TriangleTree tree(*mesh);
    for (Eigen::Index i = 0; i < points->cols(); ++i) {
      const double off = points->col(i).allFinite()
                             ? std::sqrt(tree.Closest(points->col(i)).squared_distance)
                             : std::numeric_limits<double>::infinity();
      if (off <= kFarthest_m) continue;
      throw Error("map",
                  fmt::format("pair {}: its point on the {} object is {:.3g} m off the surface", i,
                              mesh == &from ? "first" : "second", off),
                  "Give points on the surfaces in meters, in the objects' own frames");
    }
  }
  SurfaceMap map = MapFinder(from, to).ByPairs(on_from, on_to);
  map.Measure(from, to);
  return map;
}

SurfaceMap SurfaceMap::FromFile(const TriangleMesh& from, const TriangleMesh& to,
                                const std::filesystem::path& path) {
  constexpr const char* kWrite =
      "Write six numbers per row (x y z on the first object, x y z on the second), or one (a "
      "vertex of the second)";
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path)) {
    throw Error(path.string(), "cannot be read", "Give a text file of pairs of points");
  }
  std::vector<std::vector<double>> rows;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    line = line.substr(0, line.find('#'));
    std::ranges::replace(line, ',', ' ');
    std::istringstream text(line);
    std::vector<double> row;
    for (std::string word; text >> word;) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      if (end == word.c_str() || *end != '\0' || !std::isfinite(value)) {
        throw Error(path.string(), fmt::format("line {}: '{}' is not a number", number, word),
                    kWrite);
      }
      row.push_back(value);
    }
    if (row.empty()) continue;
    if ((row.size() != 6 && row.size() != 1) ||
        row.size() != (rows.empty() ? row : rows[0]).size()) {
      throw Error(path.string(), fmt::format("line {} has {} numbers", number, row.size()), kWrite);
    }
    rows.push_back(std::move(row));
  }
  const bool by_vertex = !rows.empty() && rows[0].size() == 1;
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (by_vertex && count != from.NumVertices()) {
    throw Error(
        path.string(),
        fmt::format("has {} rows, but the first object has {} vertices", count, from.NumVertices()),
        "Give a vertex of the second object for each vertex of the first");
  }
  Matrix3Xd on_from(3, count), on_to(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::vector<double>& row = rows[i];
    if (!by_vertex) {
      on_from.col(i) << row[0], row[1], row[2];
      on_to.col(i) << row[3], row[4], row[5];
      continue;
    }
    if (row[0] != std::floor(row[0]) || row[0] < 0.0 ||
        row[0] >= static_cast<double>(to.NumVertices())) {
      throw Error(path.string(),
                  fmt::format("row {} names vertex {:g}, but the second object has {} vertices", i,
                              row[0], to.NumVertices()),
                  "Count vertices from 0");
    }
    on_from.col(i) = from.vertices.col(i);
    on_to.col(i) = to.vertices.col(static_cast<Eigen::Index>(row[0]));
  }
  return NamingSource("map", path.string(), [&] { return Given(from, to, on_from, on_to); });
}

}  // namespace holdfast
