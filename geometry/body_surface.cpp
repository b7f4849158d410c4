// SPDX-License-Identifier: MIT
#include <numeric>

#include <fmt/format.h>

#include "geometry/body_model.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr int kPoseFeatures = 9 * (kNumJoints - 1);

}  // namespace

BodySurface::BodySurface(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas,
                         const Eigen::VectorXd& expression)
    : model_(std::move(model)), vertex_ids_(model_->NumVertices()) {
  std::iota(vertex_ids_.begin(), vertex_ids_.end(), 0);
  Build(betas, expression);
}

BodySurface::BodySurface(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas,
                         std::span<const int> vertex_ids, const Eigen::VectorXd& expression)
    : model_(std::move(model)), vertex_ids_(vertex_ids.begin(), vertex_ids.end()) {
  Build(betas, expression);
}

void BodySurface::Build(const Eigen::VectorXd& betas, const Eigen::VectorXd& expression) {
  const Eigen::Matrix3Xd shaped = model_->ShapedVertices(betas, expression);
  rest_joints_ = model_->RestJoints(shaped);
  const int n = static_cast<int>(vertex_ids_.size());
  rest_.resize(3, n);
  weight_begin_.assign(1, 0);
  std::vector<int> local_id(model_->NumVertices(), -1);
  for (int i = 0; i < n; ++i) {
    const int v = vertex_ids_[i];
    if (v < 0 || v >= model_->NumVertices()) {
      throw Error(model_->Name(), fmt::format("has no vertex {}", v), "Check the vertex ids");
    }
    local_id[v] = i;
    rest_.col(i) = shaped.col(v);
    weights_.insert(weights_.end(), model_->weights_[v].begin(), model_->weights_[v].end());
    weight_begin_.push_back(static_cast<int>(weights_.size()));
  }

  std::vector<Eigen::Index> kept;
  for (Eigen::Index f = 0; f < model_->faces_.cols(); ++f) {
    const auto face = model_->faces_.col(f);
    if (local_id[face(0)] >= 0 && local_id[face(1)] >= 0 && local_id[face(2)] >= 0) {
      kept.push_back(f);
    }
  }
  faces_.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t k = 0; k < kept.size(); ++k) {
    for (int c = 0; c < 3; ++c) faces_(c, k) = local_id[model_->faces_(c, kept[k])];
  }

  // One pass over the rows finds which vertices each joint moves; the second fills the blocks.
  std::vector<std::vector<int>> moved(kNumJoints);
  Eigen::Matrix<double, 3, kPoseFeatures, Eigen::RowMajor> rows;
  const auto load_rows = [&](int vertex) {
    for (int c = 0; c < 3; ++c) {
      model_->pose_dirs_.CopyRow(static_cast<std::size_t>(3 * vertex_ids_[vertex] + c), 0,
                                 kPoseFeatures, rows.row(c).data());
    }
  };
  for (int i = 0; i < n; ++i) {
    load_rows(i);
    for (int j = 1; j < kNumJoints; ++j) {
      if (!rows.middleCols<9>(9 * (j - 1)).isZero(0.0)) moved[j].push_back(i);
    }
  }
  std::vector<int> block_of_joint(kNumJoints, -1);
  for (int j = 1; j < kNumJoints; ++j) {
    if (moved[j].empty()) continue;
    block_of_joint[j] = static_cast<int>(pose_dirs_.size());
    PoseDirBlock block{j, std::move(moved[j]), {}};
    block.dirs.resize(3 * static_cast<Eigen::Index>(block.vertices.size()), 9);
    pose_dirs_.push_back(std::move(block));
  }
  std::vector<Eigen::Index> filled(pose_dirs_.size(), 0);
  for (int i = 0; i < n; ++i) {
    load_rows(i);
    for (int j = 1; j < kNumJoints; ++j) {
      if (block_of_joint[j] < 0) continue;
      PoseDirBlock& block = pose_dirs_[block_of_joint[j]];
      Eigen::Index& next = filled[block_of_joint[j]];
      if (next < static_cast<Eigen::Index>(block.vertices.size()) && block.vertices[next] == i) {
        block.dirs.middleRows<3>(3 * next++) = rows.middleCols<9>(9 * (j - 1));
      }
    }
  }
}

}  // namespace holdfast
