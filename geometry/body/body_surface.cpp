// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

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
  // Which vertices each joint moves first: most it does not.
  const BodyModelParts& parts = *model_->parts_;
  const std::size_t num_joints = parts.pose_joints.size();
  if (num_joints == 0) return;
  const auto row = [&](int vertex, std::size_t coordinate) {
    return 3 * static_cast<std::size_t>(vertex_ids_[vertex]) + coordinate;
  };
  std::vector<std::vector<int>> moved(num_joints);
  // Joints [begin, end), halved where any of them moves it.
  const auto find_joints = [&](const auto& again, int i, std::size_t begin, std::size_t end) {
    const bool none = std::ranges::all_of(std::array<std::size_t, 3>{0, 1, 2}, [&](std::size_t c) {
      return parts.pose_dirs.IsZero(row(i, c), 9 * begin, 9 * (end - begin));
    });
    if (none) return;
    if (end - begin == 1) {
      moved[begin].push_back(i);
      return;
    }
    const std::size_t middle = (begin + end) / 2;
    again(again, i, begin, middle);
    again(again, i, middle, end);
  };
  for (int i = 0; i < NumVertices(); ++i) find_joints(find_joints, i, 0, num_joints);
  for (std::size_t k = 0; k < num_joints; ++k) {
    if (moved[k].empty()) continue;
    PoseDirBlock block{parts.pose_joints[k], std::move(moved[k]), {}};
    block.dirs.resize(3 * static_cast<Eigen::Index>(block.vertices.size()), 9);
    for (std::size_t m = 0; m < block.vertices.size(); ++m) {
      for (std::size_t c = 0; c < 3; ++c) {
        parts.pose_dirs.CopyRow(row(block.vertices[m], c), 9 * k, 9,
                                block.dirs.row(static_cast<Eigen::Index>(3 * m + c)).data());
      }
    }
    pose_dirs_.push_back(std::move(block));
  }
}

}  // namespace holdfast
