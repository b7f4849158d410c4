// SPDX-License-Identifier: MIT
#pragma once

#include <cstring>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"
#include "geometry/io/container/npz.h"

namespace holdfast::testing {

/// Random numbers in the layout of an SMPL-X file: dense everywhere, as the real one is, so that a
/// formula that is wrong anywhere shows. Kept as plain arrays for an independent evaluation.
struct SyntheticBody {
  int num_vertices;
  int num_directions;  // shape and expression together
  std::vector<double> v_template, shapedirs, posedirs, regressor, weights, hand_mean_left,
      hand_mean_right;
  std::vector<std::int64_t> faces;

  explicit SyntheticBody(int vertices = 60, int directions = 20, unsigned seed = 7)
      : num_vertices(vertices), num_directions(directions) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto fill = [&](std::vector<double>& values, int count, double scale) {
      values.resize(static_cast<std::size_t>(count));
      for (double& value : values) value = scale * uniform(engine);
    };
    fill(v_template, 3 * vertices, 0.8);
    fill(shapedirs, 3 * vertices * directions, 0.02);
    fill(posedirs, 3 * vertices * 486, 0.003);
    fill(hand_mean_left, kHandDofs, 0.3);
    fill(hand_mean_right, kHandDofs, 0.3);
    const auto rows_to_one = [&](std::vector<double>& values, int rows, int columns, int kept) {
      values.assign(static_cast<std::size_t>(rows * columns), 0.0);
      std::uniform_int_distribution<int> pick(0, columns - 1);
      for (int r = 0; r < rows; ++r) {
        double sum = 0.0;
        for (int k = 0; k < kept; ++k) {
          const double w = 0.1 + std::abs(uniform(engine));
          values[static_cast<std::size_t>(r * columns + pick(engine))] += w;
          sum += w;
        }
        for (int c = 0; c < columns; ++c) values[static_cast<std::size_t>(r * columns + c)] /= sum;
      }
    };
    rows_to_one(regressor, kNumJoints, vertices, 5);
    rows_to_one(weights, vertices, kNumJoints, 4);
    for (int v = 0; v + 2 < vertices; ++v) {
      for (int k = 0; k < 3; ++k) faces.push_back(v + k);
    }
  }

  /// How the arrays are stored.
  struct Storage {
    char kind = 'f';
    std::size_t item_size = 8;
    bool fortran_order = false;
    bool big_endian = false;
  };

  NpyArray Store(const std::vector<double>& values, std::vector<std::size_t> shape,
                 const Storage& storage) const {
    NpyArray array{
        storage.kind, storage.item_size, storage.big_endian, storage.fortran_order, shape, {}};
    array.data.resize(values.size() * storage.item_size);
    for (std::size_t i = 0; i < values.size(); ++i) {
      std::size_t place = i;
      if (storage.fortran_order) {
        // C-order index -> subscripts -> first-index-fastest offset
        std::size_t rest = i, stride = 1;
        std::vector<std::size_t> subscript(shape.size());
        for (std::size_t d = shape.size(); d-- > 0;) {
          subscript[d] = rest % shape[d];
          rest /= shape[d];
        }
        place = 0;
        for (std::size_t d = 0; d < shape.size(); ++d) {
          place += subscript[d] * stride;
          stride *= shape[d];
        }
      }
      unsigned char raw[8];
      if (storage.kind == 'f' && storage.item_size == 8) {
        std::memcpy(raw, &values[i], 8);
      } else if (storage.kind == 'f') {
        const auto single = static_cast<float>(values[i]);
        std::memcpy(raw, &single, 4);
      } else {
        const auto whole = static_cast<std::int64_t>(values[i]);
        std::memcpy(raw, &whole, 8);
      }
      for (std::size_t b = 0; b < storage.item_size; ++b) {
        array.data[place * storage.item_size + b] =
            std::byte{raw[storage.big_endian ? storage.item_size - 1 - b : b]};
      }
    }
    return array;
  }

  void Write(const std::filesystem::path& path) const { Write(path, Storage{}); }

  /// `change` may replace or add members before the file is written.
  void Write(const std::filesystem::path& path, const Storage& storage,
             const std::function<void(NpzWriter&)>& change = {}) const {
    const auto V = static_cast<std::size_t>(num_vertices);
    const auto S = static_cast<std::size_t>(num_directions);
    NpzWriter writer;
    writer.Add("v_template", Store(v_template, {V, 3}, storage));
    writer.Add("shapedirs", Store(shapedirs, {V, 3, S}, storage));
    writer.Add("posedirs", Store(posedirs, {V, 3, 486}, storage));
    writer.Add("J_regressor", Store(regressor, {kNumJoints, V}, storage));
    writer.Add("weights", Store(weights, {V, kNumJoints}, storage));
    writer.Add("hands_meanl", Store(hand_mean_left, {kHandDofs}, storage));
    writer.Add("hands_meanr", Store(hand_mean_right, {kHandDofs}, storage));
    std::vector<double> corners(faces.begin(), faces.end());
    std::vector<double> tree(2 * kNumJoints);
    for (int j = 0; j < kNumJoints; ++j) {
      tree[static_cast<std::size_t>(j)] = j == 0 ? 4294967295.0 : kJointParents[j];
      tree[static_cast<std::size_t>(kNumJoints + j)] = j;
    }
    Storage whole = storage;
    whole.kind = 'i';
    if (storage.item_size == 4) whole.kind = 'u';
    writer.Add("f", Store(corners, {faces.size() / 3, 3}, whole));
    writer.Add("kintree_table", Store(tree, {2, kNumJoints}, whole));
    if (change) change(writer);
    writer.Write(path);
  }
};

}  // namespace holdfast::testing
