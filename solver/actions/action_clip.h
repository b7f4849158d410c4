// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "generator/actions/standing_start.h"
#include "geometry/clip/clip.h"
#include "solver/actions/action_studio.h"

namespace holdfast {

/// How sound a synthetic clip is.
struct ActionQuality {
  int frames = 0;
  double worst_key = 0.0;          ///< cost of the least comfortable key (ChooseKeys)
  double hand_error_rad = 0.0;     ///< what a wrist refuses, at most
  double shortfall_m = 0.0;        ///< by which an arm is too short, at most
  double penetrating = 0.0;        ///< share of frames with a holding hand over 2 mm in the object
  double deepest_mm = 0.0;         ///< of those hands, any frame
  double contact = 0.0;            ///< share of held frames in which a holding hand touches
  double object_in_body_mm = 0.0;  ///< deepest skin of head, trunk, upper arms, legs in it
  double hand_in_head_mm = 0.0;    ///< deepest skin of a hand in the head
  double arm_in_trunk_mm = 0.0;    ///< deepest skin of a hand or forearm in the trunk
  double beyond_limits = 0.0;      ///< share of joints and frames (MeasureQuality)
  double skate = 0.0;              ///< share of frames (MeasureQuality)
  double max_acceleration = 0.0;   ///< of any joint, m/s^2
  double slipped_mm = 0.0;         ///< object in the hand, between the grasp and the fit
};

struct ActionClip {
  Clip clip;  ///< with action, object track (no mesh name) and holding_hand
  ActionQuality quality;
  std::string fault;   ///< why it is not to be used, in a few words; empty when it is
  std::string detail;  ///< the same with numbers
};

struct ActionClipRequest {
  std::string_view action;
  const ActionActor& actor;
  const ActionProp& prop;  ///< mirrored where `mirrored`
  const ActionGrasps& grasps;
  const StandingStart& start;
  bool mirrored = false;  ///< a left-handed clip: all is made for a right hand, then mirrored
  std::uint64_t seed = 1;
  bool wrist_blows = false;  ///< as in ActionScene
};

/// Makes one clip: script, choice of grasp and keys, whole body, object and fingers fitted
/// (FitClip), measured. Deterministic for the request.
ActionClip MakeActionClip(const ActionClipRequest& request);

/// The first moment of such a clip, one frame: the object upright on a table, or in the hand where
/// `in_hand` (empty: drawn), held by the grasp that suits the action best; fingers and object are
/// the grasp's, not fitted. Only `fault` and `worst_key` are looked at. Without a fault the clip
/// has action, object track, holding_hand and the table, if there is one.
ActionClip MakeActionStart(const ActionClipRequest& request, std::optional<bool> in_hand);

}  // namespace holdfast
