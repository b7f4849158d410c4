// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <span>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/parallel.h"

namespace holdfast {

/// Derivatives of a scalar with respect to the inputs of a body model, in the layout of the inputs.
struct BodyGradient {
  JointPose pose;                                    ///< axis-angle of each joint
  Eigen::Vector3d trans;                             ///< trans
  Eigen::Matrix3Xd rest_vertices;                    ///< v_s of the surface (3 x n), pose fixed
  Eigen::Matrix<double, 3, kNumJoints> rest_joints;  ///< J, v_s fixed
};

/// Computes the vector-Jacobian product of the body model in one sweep from the vertices to the
/// root: VertexJacobian' d_vertices + JointJacobian' d_joints, without the Jacobians. `d_vertices`
/// are the derivatives by state.vertices (3 x n), or none (3 x 0); `d_joints` those by state.joints
/// (3 x 55). `state` must hold Forward's result for the same surface. Allocates on first use only.
void VertexAdjoint(const BodySurface& surface, const BodyState& state,
                   const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices,
                   const Eigen::Ref<const Eigen::Matrix<double, 3, kNumJoints>>& d_joints,
                   BodyGradient& gradient);

/// Derivatives with respect to the first `count` betas, from those of rest_vertices and rest_joints
/// (or their sums over frames). Zero for a subject's own surface and beyond the model's shape.
Eigen::VectorXd ShapeGradient(const BodySurface& surface, const Eigen::Matrix3Xd& rest_vertices,
                              const Eigen::Matrix<double, 3, kNumJoints>& rest_joints, int count);

/// Number of frames that are efficiently posed together; more gain little.
inline constexpr int kFramesTogether = 64;

/// Returns how many of `frames` frames to pose together when they are distributed over threads:
/// fewer for a short clip, so that no thread is idle. Does not depend on the number of threads.
constexpr int SharedFramesTogether(int frames) {
  constexpr int kShares = 8, kFewest = 4;
  return std::clamp((frames + kShares - 1) / kShares, kFewest, kFramesTogether);
}

/// Forward for T frames of one person, several times as fast. The pose blend shapes, more than a
/// hundred megabytes where they are dense, are read once for all frames, and the loops are compiled
/// for each instruction set. Each state equals the result of Forward, except that dense blend
/// shapes are summed in single precision: their millimeter offsets differ by about 1e-9 m. Local
/// blend shapes, as in the embedded body, give bitwise identical results. `trans` (3 x T), meters.
void ForwardFrames(const BodySurface& surface, std::span<const JointPose> poses,
                   const Eigen::Ref<const Eigen::Matrix3Xd>& trans, std::span<BodyState> states,
                   Isa isa = BestIsa());

/// VertexAdjoint for T frames of one person: derivatives with respect to the vertices of all frames
/// side by side (3 x n T), or none (3 x 0), and to the joints (3 x 55 T).
void VertexAdjointFrames(const BodySurface& surface, std::span<const BodyState> states,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& d_joints,
                         std::span<BodyGradient> gradients, Isa isa = BestIsa());

}  // namespace holdfast
