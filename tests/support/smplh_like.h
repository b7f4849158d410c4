// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"
#include "geometry/embedded.h"
#include "geometry/io/container/npz.h"

namespace holdfast::testing {

/// The embedded body as an SMPL-H file: 52 joints, what the jaw moved moves with the head.
/// `shift` moves the whole rest surface.
inline void WriteSmplhLike(const std::filesystem::path& path,
                           const Eigen::Vector3d& shift = Eigen::Vector3d::Zero()) {
  const EmbeddedFile file = FindEmbedded("body/holdfast_neutral.npz");
  const NpzReader body(file.bytes, "body");
  std::vector<int> joints;  // of the 55
  for (int j = 0; j < kNumJoints; ++j) {
    if (j < 22 || j > 24) joints.push_back(j);
  }
  std::vector<double> vertices = body.Read("v_template").AsDoubles();
  for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i] += shift(static_cast<int>(i % 3));
  const std::size_t V = vertices.size() / 3, J = joints.size();
  const std::vector<double> weights55 = body.Read("weights").AsDoubles();
  const std::vector<double> regressor55 = body.Read("J_regressor").AsDoubles();
  const std::vector<float> pose55 = body.Read("posedirs").AsFloats();
  const std::vector<double> shape20 = body.Read("shapedirs").AsDoubles();
  std::vector<double> weights(V * J), regressor(J * V), shape(V * 30);
  std::vector<float> pose(V * 3 * 9 * (J - 1));
  for (std::size_t v = 0; v < V; ++v) {
    for (std::size_t k = 0; k < J; ++k) {
      const auto j = static_cast<std::size_t>(joints[k]);
      weights[v * J + k] = weights55[v * 55 + j];
      regressor[k * V + v] = regressor55[j * V + v];
      for (std::size_t e = 0; k > 0 && e < 27; ++e) {
        pose[(v * 3 + e / 9) * 9 * (J - 1) + 9 * (k - 1) + e % 9] =
            pose55[(v * 3 + e / 9) * 486 + 9 * (j - 1) + e % 9];
      }
    }
    for (std::size_t j = 22; j < 25; ++j) weights[v * J + 15] += weights55[v * 55 + j];
    for (std::size_t e = 0; e < 30; ++e) {
      shape[v * 30 + e] = shape20[(v * 3 + e / 10) * 20 + e % 10];
    }
  }
  std::vector<std::int64_t> tree(2 * J);
  for (std::size_t k = 0; k < J; ++k) {
    const int parent = kJointParents[static_cast<std::size_t>(joints[k])];
    tree[k] = parent < 0 ? 4294967295 : parent < 25 ? parent : parent - 3;
    tree[J + k] = static_cast<std::int64_t>(k);
  }
  NpzWriter writer;
  writer.AddFloat64("v_template", {V, 3}, vertices);
  writer.Add("f", body.Read("f").array);
  writer.AddFloat64("weights", {V, J}, weights);
  writer.AddFloat64("J_regressor", {J, V}, regressor);
  writer.AddFloat64("shapedirs", {V, 3, 10}, shape);
  writer.AddFloat16("posedirs", {V, 3, 9 * (J - 1)}, pose);
  writer.AddInt64("kintree_table", {2, J}, tree);
  writer.Add("hands_meanl", body.Read("hands_meanl").array);
  writer.Add("hands_meanr", body.Read("hands_meanr").array);
  writer.Write(path);
}

}  // namespace holdfast::testing
