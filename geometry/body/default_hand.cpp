// SPDX-License-Identifier: MIT
#include "geometry/body/default_hand.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "geometry/body/skeleton.h"

namespace holdfast {
namespace {

// Wrist joint of MANO_RIGHT's mean shape, meters; the left one's x is negative.
constexpr double kManoWrist[3] = {0.0957, 0.0064, 0.0062};
constexpr double kMinWeight = 0.01;  // of the hand, on its vertices

bool IsOfHand(int joint, Side side) { return joint == WristJoint(side) || IsFinger(joint, side); }

std::vector<int> VerticesOfHand(const BodySurface& body, Side side) {
  std::vector<int> ids;
  for (int v = 0; v < body.NumVertices(); ++v) {
    double on_hand = 0.0;
    for (const auto& [joint, weight] : body.Weights(v)) {
      if (IsOfHand(joint, side)) on_hand += weight;
    }
    if (on_hand > kMinWeight) ids.push_back(v);
  }
  return ids;
}

// The least weights of vertices that sum to one and have `point` as their mean.
SparseRow WeightsFor(const Eigen::Vector3d& point, const Eigen::Matrix3Xd& vertices) {
  Eigen::Matrix4Xd affine(4, vertices.cols());
  affine << vertices, Eigen::RowVectorXd::Ones(vertices.cols());
  const Eigen::Matrix4d normal = affine * affine.transpose();
  const Eigen::VectorXd weights =
      affine.transpose() * normal.ldlt().solve(Eigen::Vector4d(point.homogeneous()));
  SparseRow row;
  for (int v = 0; v < weights.size(); ++v) row.emplace_back(v, weights[v]);
  return row;
}

LinearBasis PoseDirsOf(const BodySurface& hand, const std::vector<int>& joints) {
  const auto vertices = static_cast<std::size_t>(hand.NumVertices());
  const std::size_t columns = 9 * joints.size();
  std::vector<double> dirs(3 * vertices * columns, 0.0);
  for (const BodySurface::PoseDirBlock& block : hand.PoseDirs()) {
    const auto found = std::ranges::find(joints, block.joint);
    if (found == joints.end()) continue;
    const auto first = static_cast<std::size_t>(9 * (found - joints.begin()));
    for (std::size_t i = 0; i < block.vertices.size(); ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t row = 3 * static_cast<std::size_t>(block.vertices[i]) + c;
        for (std::size_t k = 0; k < 9; ++k) {
          dirs[row * columns + first + k] =
              block.dirs(static_cast<Eigen::Index>(3 * i + c), static_cast<Eigen::Index>(k));
        }
      }
    }
  }
  NpyMember member{"posedirs", {}};
  member.array.item_size = sizeof(double);
  member.array.shape = {vertices, 3, columns};
  member.array.data.resize(dirs.size() * sizeof(double));
  std::memcpy(member.array.data.data(), dirs.data(), member.array.data.size());
  return LinearBasis(std::move(member), static_cast<std::ptrdiff_t>(vertices),
                     static_cast<std::ptrdiff_t>(columns));
}

std::shared_ptr<const BodyModel> MakeHand(Side side) {
  const std::shared_ptr<const BodyModel> body = BodyModel::Default();
  const std::vector<int> ids = VerticesOfHand(BodySurface(body), side);
  const BodySurface hand(body, {}, std::span(ids));
  const int wrist = WristJoint(side);
  Eigen::Vector3d place(kManoWrist[0], kManoWrist[1], kManoWrist[2]);
  if (side == Side::kLeft) place.x() *= -1.0;
  const Eigen::Vector3d shift = place - hand.RestJoints().col(wrist);

  BodyModelParts parts;
  parts.name = fmt::format("holdfast_{}_hand", SideName(side));
  parts.kind = side == Side::kRight ? ModelKind::kManoRight : ModelKind::kManoLeft;
  parts.v_template = hand.RestVertices().colwise() + shift;
  parts.faces = hand.Faces();
  const BodyLayout& layout = LayoutOf(parts.kind);
  parts.pose_joints.assign(layout.joint_of_native.begin() + 1, layout.joint_of_native.end());
  parts.pose_dirs = PoseDirsOf(hand, parts.pose_joints);
  for (const int native : layout.native_for_rest) {
    const int joint = layout.joint_of_native[static_cast<std::size_t>(native)];
    parts.joint_regressor.push_back(
        WeightsFor(hand.RestJoints().col(joint) + shift, parts.v_template));
  }
  parts.weights.resize(ids.size());
  for (std::size_t v = 0; v < ids.size(); ++v) {
    double on_wrist = 1.0;  // the forearm's weight is the wrist's
    for (const auto& [joint, weight] : hand.Weights(static_cast<int>(v))) {
      if (!IsFinger(joint, side)) continue;
      parts.weights[v].emplace_back(joint, weight);
      on_wrist -= weight;
    }
    if (on_wrist > 0.0) parts.weights[v].emplace_back(wrist, on_wrist);
  }
  const auto h = static_cast<std::size_t>(side);
  for (auto& mean : parts.hand_mean) mean.setZero();
  for (auto& components : parts.hand_components) components.resize(0, kHandDofs);
  parts.hand_mean[h] = body->HandMean(side);
  parts.hand_components[h] = body->HandComponents(side);
  for (int v = 0; const int id : ids) {
    if (std::ranges::binary_search(body->HandVertexIds(side), id)) parts.hand_ids[h].push_back(v);
    ++v;
  }
  return std::make_shared<const BodyModel>(std::move(parts));
}

}  // namespace

std::shared_ptr<const BodyModel> DefaultHand(Side side) {
  if (side == Side::kRight) {
    static const std::shared_ptr<const BodyModel> right = MakeHand(Side::kRight);
    return right;
  }
  static const std::shared_ptr<const BodyModel> left = MakeHand(Side::kLeft);
  return left;
}

}  // namespace holdfast
