// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>

#include "geometry/clip/clip.h"
#include "solver/actions/action_studio.h"

namespace holdfast {

/// Minimum distance between an object of an action and its place at the face (FacePlaceOf).
struct FaceDistance {
  int frame = 0;  ///< frame of the minimum
  double distance_m = 0.0;
};

/// Returns nothing for actions without a place at the face. `clip`: of a right-handed person
/// (MirrorClip), with the object of `prop`.
std::optional<FaceDistance> NearestToFace(const ActionActor& actor, const ActionProp& prop,
                                          std::string_view action, const Clip& clip);

/// Moves the object to its place at the face (rim to lips, phone to ear) in all frames in which it
/// is close, because networks leave an error of centimeters. Adjusts trunk, right arm and head by
/// least squares over all frames at once (Ceres): HeldAtFace, Gaze, TrunkLean, LegReach, Balance,
/// JointRange and a prior over a cubic B-spline of changes; feet stay fixed. The object moves with
/// the hand, which keeps its grasp. The clip is unchanged if the object never comes within 15 cm of
/// its place. Returns the NearestToFace of the result.
std::optional<FaceDistance> RefitAtFace(const ActionActor& actor, const ActionProp& prop,
                                        std::string_view action, Clip& clip);

}  // namespace holdfast
