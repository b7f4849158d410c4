// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <span>

#include "geometry/body/body_model.h"
#include "geometry/body/vertex_adjoint.h"
#include "geometry/isa.h"

namespace holdfast {

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
