// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Derivatives of a number by what a body was posed with. Columns as those of what they belong to.
struct BodyGradient {
  JointPose pose;                                    ///< by the axis-angle of each joint
  Eigen::Vector3d trans;                             ///< by trans
  Eigen::Matrix3Xd rest_vertices;                    ///< by v_s of the surface (3 x n), pose held
  Eigen::Matrix<double, 3, kNumJoints> rest_joints;  ///< by J, v_s held
};

/// The vector-Jacobian product of the body model, in one sweep from the vertices to the root: what
/// VertexJacobian' d_vertices + JointJacobian' d_joints is, without the Jacobians. `d_vertices` are
/// the derivatives by state.vertices (3 x n), or none (3 x 0); `d_joints` those by state.joints
/// (3 x 55). `state` must hold Forward's result for the same surface. Allocates on first use only.
void VertexAdjoint(const BodySurface& surface, const BodyState& state,
                   const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices,
                   const Eigen::Ref<const Eigen::Matrix<double, 3, kNumJoints>>& d_joints,
                   BodyGradient& gradient);

/// What skinning and the pose blend shapes pass on to the joints: derivatives by G_j^R without the
/// part that comes through A_j^t, by R_j, and by A_j^t.
struct SkinGradient {
  std::array<Eigen::Matrix3d, kNumJoints> world, local;
  Eigen::Matrix<double, 3, kNumJoints> offset;
};

/// The second half of VertexAdjoint, from `skin` down the tree: everything but rest_vertices.
void JointAdjoint(const BodySurface& surface, const BodyState& state, SkinGradient& skin,
                  const Eigen::Ref<const Eigen::Matrix<double, 3, kNumJoints>>& d_joints,
                  BodyGradient& gradient);

/// Derivatives by the first `count` betas, of rest_vertices and rest_joints (sums over frames do as
/// well: they are linear). Zero for a subject's own surface and beyond the model's shape.
Eigen::VectorXd ShapeGradient(const BodySurface& surface, const Eigen::Matrix3Xd& rest_vertices,
                              const Eigen::Matrix<double, 3, kNumJoints>& rest_joints, int count);

}  // namespace holdfast
