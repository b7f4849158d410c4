// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>

#include "geometry/clip/clip.h"
#include "solver/actions/action_studio.h"

namespace holdfast {

/// How near what an action brings to the face comes to it (FacePlaceOf).
struct FaceDistance {
  int frame = 0;  ///< in which it is nearest
  double distance_m = 0.0;
};

/// Nothing for actions without a place at the face. `clip`: of a right-handed person (MirrorClip),
/// its object that of `prop`.
std::optional<FaceDistance> NearestToFace(const ActionActor& actor, const ActionProp& prop,
                                          std::string_view action, const Clip& clip);

/// Brings what belongs at the face there: the rim to the lips, the phone to the ear, in all frames
/// in which it is nearly there. Networks bring it within centimeters. Trunk, right arm and head
/// give, by least squares over all frames at once (Ceres): HeldAtFace, Gaze, TrunkLean, LegReach,
/// Balance, JointRange and a prior over a cubic B-spline of changes; feet stay. The object goes
/// along with the hand, which keeps its grasp. Leaves the clip as it is where the object never
/// comes within 15 cm of its place. Returns what NearestToFace finds afterwards.
std::optional<FaceDistance> RefitAtFace(const ActionActor& actor, const ActionProp& prop,
                                        std::string_view action, Clip& clip);

}  // namespace holdfast
