// SPDX-License-Identifier: MIT
#include <numeric>

#include <fmt/format.h>

#include "geometry/body/body_model.h"
#include "geometry/error.h"

namespace holdfast {

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
    const SparseRow& weights = model_->parts_->weights[static_cast<std::size_t>(v)];
    weights_.insert(weights_.end(), weights.begin(), weights.end());
    weight_begin_.push_back(static_cast<int>(weights_.size()));
  }

  std::vector<Eigen::Index> kept;
  const Eigen::Matrix3Xi& all_faces = model_->Faces();
  for (Eigen::Index f = 0; f < all_faces.cols(); ++f) {
    const auto face = all_faces.col(f);
    if (local_id[face(0)] >= 0 && local_id[face(1)] >= 0 && local_id[face(2)] >= 0) {
      kept.push_back(f);
    }
  }
  faces_.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t k = 0; k < kept.size(); ++k) {
    for (int c = 0; c < 3; ++c) faces_(c, k) = local_id[all_faces(c, kept[k])];
  }

  BuildPoseDirs();
}

void BodySurface::BuildPoseDirs() {
  // One pass over the rows finds which vertices each joint moves; the second fills the blocks.
  const BodyModelParts& parts = *model_->parts_;
  const std::size_t num_joints = parts.pose_joints.size();
  if (num_joints == 0) return;
  std::vector<double> rows(3 * 9 * num_joints);
  const auto load_rows = [&](int vertex) {
    for (std::size_t c = 0; c < 3; ++c) {
      parts.pose_dirs.CopyRow(3 * static_cast<std::size_t>(vertex_ids_[vertex]) + c, 0,
                              9 * num_joints, rows.data() + 9 * num_joints * c);
    }
  };
  using Rows =
      Eigen::Map<const Eigen::Matrix<double, 3, 9, Eigen::RowMajor>, 0, Eigen::OuterStride<>>;
  const auto of_joint = [&](std::size_t k) {
    return Rows(rows.data() + 9 * k,
                Eigen::OuterStride<>(static_cast<Eigen::Index>(9 * num_joints)));
  };
  const int n = NumVertices();
  std::vector<std::vector<int>> moved(num_joints);
  for (int i = 0; i < n; ++i) {
    load_rows(i);
    for (std::size_t k = 0; k < num_joints; ++k) {
      if (!of_joint(k).isZero(0.0)) moved[k].push_back(i);
    }
  }
  std::vector<int> block_of_joint(num_joints, -1);
  for (std::size_t k = 0; k < num_joints; ++k) {
    if (moved[k].empty()) continue;
    block_of_joint[k] = static_cast<int>(pose_dirs_.size());
    PoseDirBlock block{parts.pose_joints[k], std::move(moved[k]), {}};
    block.dirs.resize(3 * static_cast<Eigen::Index>(block.vertices.size()), 9);
    pose_dirs_.push_back(std::move(block));
  }
  std::vector<Eigen::Index> filled(pose_dirs_.size(), 0);
  for (int i = 0; i < n; ++i) {
    load_rows(i);
    for (std::size_t k = 0; k < num_joints; ++k) {
      if (block_of_joint[k] < 0) continue;
      PoseDirBlock& block = pose_dirs_[block_of_joint[k]];
      Eigen::Index& next = filled[block_of_joint[k]];
      if (next < static_cast<Eigen::Index>(block.vertices.size()) && block.vertices[next] == i) {
        block.dirs.middleRows<3>(3 * next++) = of_joint(k);
      }
    }
  }
}

}  // namespace holdfast
