// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <filesystem>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "geometry/body/body_model.h"
#include "geometry/io/container/npz.h"

namespace holdfast::testing {

/// A hand of the embedded body as a MANO file: 16 joints, the same fields. The wrist's place is
/// moved to near the origin, as MANO's is.
inline void WriteManoLike(const std::filesystem::path& path, Side side) {
  const auto body = BodyModel::Default();
  const std::vector<int>& ids = body->HandVertexIds(side);
  const BodySurface surface(body, {}, ids);
  const auto V = ids.size();
  const int wrist = WristJoint(side), first = HandBegin(side);
  const auto native = [&](int joint) {
    return joint >= first && joint < first + kJointsPerHand ? joint - first + 1 : 0;
  };
  const Eigen::Vector3d origin = surface.RestJoints().col(wrist) - Eigen::Vector3d(0.09, 0.01, 0.0);

  std::vector<double> vertices, weights(V * 16, 0.0), regressor(16 * V, 0.0), shape(V * 3 * 10),
      pose(V * 3 * 135, 0.0), identity(45 * 45, 0.0);
  for (std::size_t v = 0; v < V; ++v) {
    for (int c = 0; c < 3; ++c) {
      vertices.push_back(surface.RestVertices()(c, static_cast<int>(v)) - origin(c));
    }
    for (const auto& [joint, w] : surface.Weights(static_cast<int>(v))) {
      weights[v * 16 + static_cast<std::size_t>(native(joint))] += w;
    }
  }
  // A joint is the mean of the vertices near it, corrected to lie where the body has it: least
  // squares over the sixteen nearest, weights summing to one.
  for (int k = 0; k < 16; ++k) {
    const Eigen::Vector3d place = surface.RestJoints().col(k == 0 ? wrist : first + k - 1);
    std::vector<std::pair<double, int>> near;
    for (std::size_t v = 0; v < V; ++v) {
      near.emplace_back((surface.RestVertices().col(static_cast<int>(v)) - place).norm(),
                        static_cast<int>(v));
    }
    std::partial_sort(near.begin(), near.begin() + 16, near.end());
    Eigen::Matrix<double, 4, 16> A;
    for (int i = 0; i < 16; ++i) {
      A.col(i) << surface.RestVertices().col(near[static_cast<std::size_t>(i)].second), 1.0;
    }
    const Eigen::Vector4d target(place.x(), place.y(), place.z(), 1.0);
    const Eigen::Matrix<double, 16, 1> w =
        A.transpose() * (A * A.transpose() + 1e-6 * Eigen::Matrix4d::Identity()).inverse() * target;
    for (int i = 0; i < 16; ++i) {
      regressor[static_cast<std::size_t>(k) * V +
                static_cast<std::size_t>(near[static_cast<std::size_t>(i)].second)] =
          w(i) / w.sum();
    }
  }
  for (int b = 0; b < 10; ++b) {
    const BodySurface shaped(body, Eigen::VectorXd::Unit(10, b), ids);
    const Eigen::Vector3d shift = shaped.RestJoints().col(wrist) - surface.RestJoints().col(wrist);
    for (std::size_t v = 0; v < V; ++v) {
      for (int c = 0; c < 3; ++c) {
        const int i = static_cast<int>(v);
        shape[(v * 3 + static_cast<std::size_t>(c)) * 10 + static_cast<std::size_t>(b)] =
            shaped.RestVertices()(c, i) - surface.RestVertices()(c, i) - shift(c);
      }
    }
  }
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    const int k = native(block.joint);
    if (k == 0) continue;
    for (std::size_t m = 0; m < block.vertices.size(); ++m) {
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t e = 0; e < 9; ++e) {
          pose[(static_cast<std::size_t>(block.vertices[m]) * 3 + c) * 135 +
               9 * static_cast<std::size_t>(k - 1) + e] =
              block.dirs(static_cast<int>(3 * m + c), static_cast<int>(e));
        }
      }
    }
  }
  for (std::size_t i = 0; i < 45; ++i) identity[46 * i] = 1.0;
  std::vector<std::int64_t> faces, tree(32);
  for (Eigen::Index f = 0; f < surface.Faces().size(); ++f) faces.push_back(surface.Faces()(f));
  for (std::size_t k = 0; k < 16; ++k) {
    tree[k] = k == 0 ? 4294967295 : k % 3 == 1 ? 0 : static_cast<std::int64_t>(k) - 1;
    tree[16 + k] = static_cast<std::int64_t>(k);
  }
  const auto mean = body->HandMean(side);
  NpzWriter writer;
  writer.AddFloat64("v_template", {V, 3}, vertices);
  writer.AddInt64("f", {faces.size() / 3, 3}, faces);
  writer.AddFloat64("weights", {V, 16}, weights);
  writer.AddFloat64("J_regressor", {16, V}, regressor);
  writer.AddFloat64("shapedirs", {V, 3, 10}, shape);
  writer.AddFloat64("posedirs", {V, 3, 135}, pose);
  writer.AddFloat64("hands_mean", {45}, {mean.begin(), mean.end()});
  writer.AddFloat64("hands_components", {45, 45}, identity);
  writer.AddInt64("kintree_table", {2, 16}, tree);
  writer.Write(path);
}

}  // namespace holdfast::testing
