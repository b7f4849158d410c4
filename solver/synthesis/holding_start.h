// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/object/load_object.h"
#include "solver/actions/action_studio.h"
#include "solver/carry/first_grasp.h"
#include "solver/grasp/grasp.h"

namespace holdfast {

/// A start of a person with the object in the right hand. For a left hand, person and object are
/// mirrored at x = 0 (MirrorClip, ReflectX), and so is the synthesized motion.
struct HoldingStart {
  Clip clip;
  std::unique_ptr<const ActionActor> actor;
  std::unique_ptr<const ActionProp> prop;  ///< mirrored as the clip is
  bool mirrored = false;
  /// Direction of a vessel's opening in the object's frame; none for other objects.
  std::optional<Eigen::Vector3d> opening = {};
  /// One frame of the person with the object between both hands. The motion is generated for the
  /// right hand, which networks know, and taken over by both (TakeInBothHands).
  std::optional<Clip> both = {};
};

/// Creates a start from a frame of a clip in which a hand holds the object; default: the last
/// frame. Throws Error, named `source`, for a missing frame, a frame in which nobody holds the
/// object, a clip of a hand alone, and positions that are not in meters.
HoldingStart StartInClip(const Clip& clip, const ClipBody& body, const LoadedObject& object,
                         std::optional<int> frame = {}, int threads = 1,
                         const std::string& source = "the clip");

struct StandingHoldOptions {
  GraspHands hands = GraspHands::kRight;  ///< kRight, kLeft or kBoth
  std::optional<bool> in_hand;            ///< not on a table; default: random
  std::uint64_t seed = 1;
  int threads = 1;
};

struct StandingHold {
  HoldingStart start;
  GraspStatus grasp{};        ///< of the search
  bool graspable = false;     ///< whether there is a grasp of the object
  std::string fault, detail;  ///< why there is no start, or none of the action; empty if made
};

/// Creates a standing person of this body with the object in the hand, on a table or in front of
/// the waist, such that the action (its label) can be performed; with both hands, the object is
/// between them (HoldStanding). Throws Error for a hand alone, and FitFailure if two hands cannot
/// hold the object.
StandingHold MakeStandingHold(const ClipBody& body, const LoadedObject& object,
                              std::string_view action, const StandingHoldOptions& options = {});

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
