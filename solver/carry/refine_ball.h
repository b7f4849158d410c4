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

/// Whether the clip's object is a ball whose rotation was not recorded: all vertices within 2 % of
/// one distance from their middle, and one rotation in all frames of a track that moves.
bool IsUnturnedBall(const Clip& clip, const TriangleMesh& object);

/// What fingertips do, counted over the frames in which the object follows their hand. The pad of
/// the last phalanx counts (HandLandmarks::Pad).
struct FingertipCounts {
  int touch = 0;   ///< nearer than 5 mm, and no deeper than 2 mm
  int beside = 0;  ///< farther: they do not touch
  int inside = 0;  ///< deeper
};
FingertipCounts CountFingertips(const Clip& clip, std::span<const HandModel* const> hands,
                                const PreparedObject& object,
                                std::span<const std::uint8_t> follows);

/// Cleans a clip of a ball in hands (IsUnturnedBall). `follows` says which hands it follows in each
/// frame (FindFollows). The ball is where it was tracked, lifted where it would be in the ground;
/// arms and fingers avoid it wherever they are near, smoothly (`lambda_acceleration` is for
/// 60 Hz, and means the same time at other rates). Where it follows a hand, what of the hand is
/// nearest to it and the pads of those fingertips that are not more than 5 cm farther are drawn
/// onto it; where on the ball is free, as its rotation is. What still gets into the ball is pushed
/// out with growing weight, in up to four solves of the frames in a row. `options`' threads are
/// used; the result does not depend on them. Throws Error for a clip without an object track.
RefineResult RefineBall(const Clip& clip, std::span<const HandModel* const> hands,
                        const PreparedObject& object, std::span<const std::uint8_t> follows,
                        const FitOptions& options,
                        const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
