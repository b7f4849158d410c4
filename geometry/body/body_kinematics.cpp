// SPDX-License-Identifier: MIT
#include "geometry/body/body_kinematics.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/body/body_model.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// World rotation axes of joint j per unit of its axis-angle: G_parent Jl(theta_j).
Eigen::Matrix3d WorldAxes(const BodyState& state, int joint) {
  const Eigen::Matrix3d left_jacobian = LeftJacobianSO3(state.pose.col(joint));
  const int parent = kJointParents[static_cast<std::size_t>(joint)];
  return parent < 0 ? left_jacobian : Eigen::Matrix3d(state.world_rotation[parent] * left_jacobian);
}

// Column of each joint's first derivative in a Jacobian; -1 for joints that are not requested.
std::array<int, kNumJoints> ColumnOfJoint(std::span<const int> joints) {
  std::array<int, kNumJoints> column;
  column.fill(-1);
  for (std::size_t k = 0; k < joints.size(); ++k) column[joints[k]] = static_cast<int>(3 * k);
  return column;
}

}  // namespace

Eigen::Matrix<double, 9, 3> RotationJacobian(const Eigen::Matrix3d& left_jacobian,
                                             const Eigen::Matrix3d& R) {
  Eigen::Matrix<double, 9, 3> J;
  for (int m = 0; m < 3; ++m) {
    const Eigen::Vector3d omega = left_jacobian.col(m);
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> dR = Skew(omega) * R;
    J.col(m) = dR.reshaped<Eigen::RowMajor>();
  }
  return J;
}

void ForwardJoints(const Eigen::Matrix3Xd& rest_joints, const JointPose& pose,
                   const Eigen::Vector3d& trans, BodyState& state) {
  state.pose = pose;
  for (int j = 0; j < kNumJoints; ++j) {
    state.local_rotation[j] = ExpSO3(pose.col(j));
    const int parent = kJointParents[j];
    if (parent < 0) {
      state.world_rotation[j] = state.local_rotation[j];
      state.joints.col(j) = rest_joints.col(j) + trans;
    } else {
      state.world_rotation[j].noalias() = state.world_rotation[parent] * state.local_rotation[j];
      state.joints.col(j) =
          state.world_rotation[parent] * (rest_joints.col(j) - rest_joints.col(parent)) +
          state.joints.col(parent);
    }
    state.skin_offset.col(j) = state.joints.col(j) - state.world_rotation[j] * rest_joints.col(j);
  }
}

void BodySurface::PoseDirBlock::AddTo(Eigen::Matrix3Xd& posed,
                                      const Eigen::Matrix3d& rotation) const {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> difference =
      rotation - Eigen::Matrix3d::Identity();
  const Eigen::Map<const Eigen::Matrix<double, 9, 1>> feature(difference.data());
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    posed.col(vertices[k]).noalias() +=
        dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k)) * feature;
  }
}

void Forward(const BodySurface& surface, const JointPose& pose, const Eigen::Vector3d& trans,
             BodyState& state) {
  ForwardJoints(surface.RestJoints(), pose, trans, state);
  state.posed_rest = surface.RestVertices();
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    block.AddTo(state.posed_rest, state.local_rotation[block.joint]);
  }
  const int n = surface.NumVertices();
  state.vertices.resize(3, n);
  for (int i = 0; i < n; ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& [joint, w] : surface.Weights(i)) {
      sum += w *
             (state.world_rotation[joint] * state.posed_rest.col(i) + state.skin_offset.col(joint));
    }
    state.vertices.col(i) = sum;
  }
}

JointPose AddHandMean(const BodyModel& model, const JointPose& pose) {
  JointPose result = pose;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    result.middleCols<kJointsPerHand>(HandBegin(side)) +=
        model.HandMean(side).reshaped(3, kJointsPerHand);
  }
  return result;
}

JointPose RemoveHandMean(const BodyModel& model, const JointPose& pose) {
  return 2.0 * pose - AddHandMean(model, pose);
}

void VertexJacobian(const BodySurface& surface, const BodyState& state, std::span<const int> joints,
                    JacobianMatrix& J_vertices_params) {
  const int n = surface.NumVertices();
  const auto trans_column = static_cast<Eigen::Index>(3 * joints.size());
  J_vertices_params.setZero(3 * n, trans_column + 3);
  const std::array<int, kNumJoints> column = ColumnOfJoint(joints);
  std::array<Eigen::Matrix3d, kNumJoints> axes;
  for (const int j : joints) axes[j] = WorldAxes(state, j);

  // Skinning: joint a moves the part of vertex i skinned to a and its descendants. A rotation of a
  // by omega moves that part by omega x (sum w x - (sum w) G_a^t).
  Eigen::Matrix<double, 3, kNumJoints> carried;
  std::array<double, kNumJoints> carried_weight;
  for (int i = 0; i < n; ++i) {
    carried.setZero();
    carried_weight.fill(0.0);
    for (const auto& [joint, w] : surface.Weights(i)) {
      const Eigen::Vector3d x =
          state.world_rotation[joint] * state.posed_rest.col(i) + state.skin_offset.col(joint);
      for (int a = joint; a >= 0; a = kJointParents[a]) {
        carried.col(a) += w * x;
        carried_weight[a] += w;
      }
    }
    for (const int a : joints) {
      if (carried_weight[a] == 0.0) continue;
      const Eigen::Vector3d arm = carried.col(a) - carried_weight[a] * state.joints.col(a);
      J_vertices_params.block<3, 3>(3 * i, column[a]).noalias() = -Skew(arm) * axes[a];
    }
    J_vertices_params.block<3, 3>(3 * i, trans_column).setIdentity();
  }

  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    if (column[block.joint] < 0) continue;
    const Eigen::Matrix<double, 9, 3> J_rotation = RotationJacobian(
        LeftJacobianSO3(state.pose.col(block.joint)), state.local_rotation[block.joint]);
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      const int i = block.vertices[k];
      Eigen::Matrix3d blend = Eigen::Matrix3d::Zero();
      for (const auto& [joint, w] : surface.Weights(i)) blend += w * state.world_rotation[joint];
      const Eigen::Matrix3d moved =
          block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k)) * J_rotation;
      J_vertices_params.block<3, 3>(3 * i, column[block.joint]).noalias() += blend * moved;
    }
  }
}

void JointJacobian(const BodyState& state, std::span<const int> joints,
                   JacobianMatrix& J_joints_params) {
  const auto trans_column = static_cast<Eigen::Index>(3 * joints.size());
  J_joints_params.setZero(3 * kNumJoints, trans_column + 3);
  const std::array<int, kNumJoints> column = ColumnOfJoint(joints);
  for (const int a : joints) {
    const Eigen::Matrix3d axes = WorldAxes(state, a);
    for (int j = a + 1; j < kNumJoints; ++j) {
      int ancestor = kJointParents[j];
      while (ancestor > a) ancestor = kJointParents[ancestor];
      if (ancestor != a) continue;
      const Eigen::Vector3d arm = state.joints.col(j) - state.joints.col(a);
      J_joints_params.block<3, 3>(3 * j, column[a]).noalias() = -Skew(arm) * axes;
    }
  }
  for (int j = 0; j < kNumJoints; ++j) {
    J_joints_params.block<3, 3>(3 * j, trans_column).setIdentity();
  }
}

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
  // First determine which vertices each joint moves: most do not move.
  const BodyModelParts& parts = *model_->parts_;
  const std::size_t num_joints = parts.pose_joints.size();
  if (num_joints == 0) return;
  const auto row = [&](int vertex, std::size_t coordinate) {
    return 3 * static_cast<std::size_t>(vertex_ids_[vertex]) + coordinate;
  };
  std::vector<std::vector<int>> moved(num_joints);
  // Joints [begin, end), bisected while any of them moves the vertex.
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

Eigen::Vector3d EndSite(const BodySurface& surface, int joint) {
  Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
  for (int v = 0; v < surface.NumVertices(); ++v) {
    for (const auto& [other, weight] : surface.Weights(v)) {
      if (other != joint || weight <= 0.5) continue;
      const Eigen::Vector3d offset =
          surface.RestVertices().col(v) - surface.RestJoints().col(joint);
      if (offset.squaredNorm() > farthest.squaredNorm()) farthest = offset;
    }
  }
  return farthest;
}

}  // namespace holdfast
