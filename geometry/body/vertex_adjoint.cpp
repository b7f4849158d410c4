// SPDX-License-Identifier: MIT
#include "geometry/body/vertex_adjoint.h"

#include <algorithm>
#include <cassert>

#include "geometry/rotation.h"

namespace holdfast {
namespace {

void AddSkin(const BodySurface& surface, const BodyState& state,
             const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices, Eigen::Matrix3Xd& d_posed_rest,
             SkinGradient& skin) {
  for (Eigen::Index i = 0; i < d_vertices.cols(); ++i) {
    for (const auto& [joint, w] : surface.Weights(static_cast<int>(i))) {
      const Eigen::Vector3d share = w * d_vertices.col(i);
      skin.offset.col(joint) += share;
      skin.world[joint].noalias() += share * state.posed_rest.col(i).transpose();
      d_posed_rest.col(i).noalias() += state.world_rotation[joint].transpose() * share;
    }
  }
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    Eigen::Matrix<double, 9, 1> feature = Eigen::Matrix<double, 9, 1>::Zero();
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      feature.noalias() += block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k)).transpose() *
                           d_posed_rest.col(block.vertices[k]);
    }
    skin.local[block.joint] += feature.reshaped<Eigen::RowMajor>(3, 3);
  }
}

// Derivative with respect to the axis-angle w of R = exp([w]x): dR = [Jl dw]x R, and <D, [omega]x
// R> is the dot product of omega with the axial vector of D R'.
Eigen::Vector3d ByAxisAngle(const Eigen::Matrix3d& d_rotation, const Eigen::Matrix3d& R,
                            const Eigen::Vector3d& w) {
  const Eigen::Matrix3d turned = d_rotation * R.transpose();
  const Eigen::Vector3d axial(turned(2, 1) - turned(1, 2), turned(0, 2) - turned(2, 0),
                              turned(1, 0) - turned(0, 1));
  return LeftJacobianSO3(w).transpose() * axial;
}

}  // namespace

void VertexAdjoint(const BodySurface& surface, const BodyState& state,
                   const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices,
                   const Eigen::Ref<const Eigen::Matrix<double, 3, kNumJoints>>& d_joints,
                   BodyGradient& gradient) {
  assert(d_vertices.cols() == 0 || d_vertices.cols() == surface.NumVertices());
  SkinGradient skin;
  skin.world.fill(Eigen::Matrix3d::Zero());
  skin.local.fill(Eigen::Matrix3d::Zero());
  skin.offset.setZero();
  gradient.rest_vertices.setZero(3, surface.NumVertices());
  if (d_vertices.cols() > 0) {
    AddSkin(surface, state, d_vertices, gradient.rest_vertices, skin);
  }
  JointAdjoint(surface, state, skin, d_joints, gradient);
}

void JointAdjoint(const BodySurface& surface, const BodyState& state, SkinGradient& skin,
                  const Eigen::Ref<const Eigen::Matrix<double, 3, kNumJoints>>& d_joints,
                  BodyGradient& gradient) {
  gradient.rest_joints.setZero();
  // A_j^t = G_j^t - G_j^R J_j; then, from the leaves to the root, G_j^R = G_parent^R R_j and G_j^t
  // = G_parent^R (J_j - J_parent) + G_parent^t.
  const Eigen::Matrix3Xd& J = surface.RestJoints();
  Eigen::Matrix<double, 3, kNumJoints> origin = d_joints + skin.offset;
  for (int j = kNumJoints - 1; j >= 0; --j) {
    const Eigen::Matrix3d& R = state.local_rotation[j];
    Eigen::Matrix3d& world = skin.world[j];
    world.noalias() -= skin.offset.col(j) * J.col(j).transpose();
    gradient.rest_joints.col(j).noalias() -=
        state.world_rotation[j].transpose() * skin.offset.col(j);
    const int parent = kJointParents[static_cast<std::size_t>(j)];
    if (parent < 0) {
      skin.local[j] += world;
      gradient.trans = origin.col(j);
      gradient.rest_joints.col(j) += origin.col(j);
    } else {
      const Eigen::Matrix3d from_world = state.world_rotation[parent].transpose();
      skin.local[j].noalias() += from_world * world;
      skin.world[parent].noalias() += world * R.transpose();
      skin.world[parent].noalias() += origin.col(j) * (J.col(j) - J.col(parent)).transpose();
      origin.col(parent) += origin.col(j);
      const Eigen::Vector3d along = from_world * origin.col(j);
      gradient.rest_joints.col(j) += along;
      gradient.rest_joints.col(parent) -= along;
    }
    gradient.pose.col(j) = ByAxisAngle(skin.local[j], R, state.pose.col(j));
  }
}

Eigen::VectorXd ShapeGradient(const BodySurface& surface, const Eigen::Matrix3Xd& rest_vertices,
                              const Eigen::Matrix<double, 3, kNumJoints>& rest_joints, int count) {
  const BodyModel& model = surface.Model();
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(count);
  for (int k = 0; k < std::min(count, model.NumShape()); ++k) {
    const Eigen::Matrix3Xd moved =
        model.ShapedVertices(Eigen::VectorXd::Unit(k + 1, k)) - model.Template();
    gradient[k] = rest_joints.cwiseProduct(model.RestJoints(moved)).sum();
    for (int i = 0; i < surface.NumVertices(); ++i) {
      gradient[k] += rest_vertices.col(i).dot(moved.col(surface.VertexIds()[i]));
    }
  }
  return gradient;
}

}  // namespace holdfast
