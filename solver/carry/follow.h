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

/// Bits as in Clip::holding_hand, per frame: hands that the object follows, regardless of skin and
/// fingers: they are within 5 cm of each other and move together. Does not need the object's
/// rotation. The result does not depend on `threads`. Throws Error for a clip without an object
/// track.
///
/// On SkillMimic's basketball clips (61; 6 cm from the nearest joint instead of the skin),
/// precision against the contact labels is 94 % and recall 96 %; with 0.8 m/s instead of 1.5 they
/// are 95 % and 87 %, and most dribbling is missed.
std::vector<std::uint8_t> FindFollows(const Clip& clip, std::span<const HandModel* const> hands,
                                      const PreparedObject& object, int threads = 1);

/// Distance from the skin of a hand in the clip to the object, meters, per frame; negative inside.
std::vector<double> SkinGaps(const Clip& clip, const HandModel& hand, const PreparedObject& object,
                             int threads = 1);

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
