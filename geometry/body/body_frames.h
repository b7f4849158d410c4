// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <span>

#include "geometry/body/body_model.h"
#include "geometry/body/vertex_adjoint.h"
#include "geometry/isa.h"

namespace holdfast {

/// Frames that are worth posing together; more gain little.
inline constexpr int kFramesTogether = 64;

/// How many of `frames` frames to pose together where threads share them: fewer of a short clip, so
/// that none of them is left with nothing to do. Does not depend on how many threads there are.
constexpr int SharedFramesTogether(int frames) {
  constexpr int kShares = 8, kFewest = 4;
  return std::clamp((frames + kShares - 1) / kShares, kFewest, kFramesTogether);
}

/// Forward for T frames of one person, several times as fast: the pose blend shapes, more than a
/// hundred megabytes where they are dense, are read once for all frames, and the loops are built
/// for each instruction set. Each state is what Forward gives, but that dense blend shapes are
/// summed in single precision: their millimeters are off by about 1e-9 m. Local ones, as the
/// embedded body's, give the same bits. `trans` (3 x T), meters.
void ForwardFrames(const BodySurface& surface, std::span<const JointPose> poses,
                   const Eigen::Ref<const Eigen::Matrix3Xd>& trans, std::span<BodyState> states,
                   Isa isa = BestIsa());

/// VertexAdjoint for T frames of one person, in the same way: derivatives by the vertices of all
/// frames side by side (3 x n T), or none (3 x 0), and by the joints (3 x 55 T).
void VertexAdjointFrames(const BodySurface& surface, std::span<const BodyState> states,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& d_joints,
                         std::span<BodyGradient> gradients, Isa isa = BestIsa());

}  // namespace holdfast
