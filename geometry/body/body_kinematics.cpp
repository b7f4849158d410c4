// SPDX-License-Identifier: MIT
#include "geometry/body/body_model.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// d vec(R) / d w (9 x 3, R row-major) for R = exp([w]x): column m is vec([Jl e_m]x R).
Eigen::Matrix<double, 9, 3> RotationJacobian(const Eigen::Vector3d& w, const Eigen::Matrix3d& R) {
  const Eigen::Matrix3d left_jacobian = LeftJacobianSO3(w);
  Eigen::Matrix<double, 9, 3> J;
  for (int m = 0; m < 3; ++m) {
    const Eigen::Vector3d omega = left_jacobian.col(m);
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> dR = Skew(omega) * R;
    J.col(m) = dR.reshaped<Eigen::RowMajor>();
  }
  return J;
}

// World axes about which joint j turns per unit of its axis-angle: G_parent Jl(theta_j).
Eigen::Matrix3d WorldAxes(const BodyState& state, int joint) {
  const Eigen::Matrix3d left_jacobian = LeftJacobianSO3(state.pose.col(joint));
  const int parent = kJointParents[static_cast<std::size_t>(joint)];
  return parent < 0 ? left_jacobian : Eigen::Matrix3d(state.world_rotation[parent] * left_jacobian);
}

// Column of each joint's first derivative in a Jacobian, -1 for joints that are not asked for.
std::array<int, kNumJoints> ColumnOfJoint(std::span<const int> joints) {
  std::array<int, kNumJoints> column;
  column.fill(-1);
  for (std::size_t k = 0; k < joints.size(); ++k) column[joints[k]] = static_cast<int>(3 * k);
  return column;
}

}  // namespace

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

void Forward(const BodySurface& surface, const JointPose& pose, const Eigen::Vector3d& trans,
             BodyState& state) {
  ForwardJoints(surface.RestJoints(), pose, trans, state);
  state.posed_rest = surface.RestVertices();
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> difference =
        state.local_rotation[block.joint] - Eigen::Matrix3d::Identity();
    const Eigen::Map<const Eigen::Matrix<double, 9, 1>> feature(difference.data());
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      state.posed_rest.col(block.vertices[k]).noalias() +=
          block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k)) * feature;
    }
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

  // Skinning: joint a carries, of vertex i, the part skinned to a and its descendants; turning a
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
    const Eigen::Matrix<double, 9, 3> J_rotation =
        RotationJacobian(state.pose.col(block.joint), state.local_rotation[block.joint]);
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

}  // namespace holdfast
