// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/clip_refinement.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// Whether the clip's object is a ball without recorded rotation: all vertices are within 2 % of
/// one distance from their center, and the rotation is constant in a track that moves.
bool IsUnturnedBall(const Clip& clip, const TriangleMesh& object);

/// Fingertip states, counted over the frames in which the object follows their hand, for the pad of
/// the last phalanx (HandLandmarks::Pad).
struct FingertipCounts {
  int touch = 0;   ///< nearer than 5 mm, and no deeper than 2 mm
  int beside = 0;  ///< farther: no contact
  int inside = 0;  ///< deeper
};
FingertipCounts CountFingertips(const Clip& clip, std::span<const HandModel* const> hands,
                                const PreparedObject& object,
                                std::span<const std::uint8_t> follows);

/// Refines a clip of a ball in hands (IsUnturnedBall). `follows`: the hands that it follows in each
/// frame (FindFollows). The ball keeps its tracked position, lifted where it would be in the
/// ground. Arms and fingers avoid it smoothly wherever they are near (`lambda_acceleration` is for
/// 60 Hz, and is scaled to the same time at other rates). Where the ball follows a hand, the
/// nearest part of the hand and the pads of fingertips at most 5 cm farther are attracted to it;
/// the location on the ball is free, as is its rotation. Remaining penetration is resolved with
/// growing weight, in up to four solves of successive frames. Uses `options`' threads; the result
/// does not depend on them. Throws Error for a clip without an object track.
RefineResult RefineBall(const Clip& clip, std::span<const HandModel* const> hands,
                        const PreparedObject& object, std::span<const std::uint8_t> follows,
                        const FitOptions& options,
                        const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
