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

/// Quality measures of a synthetic clip.
struct ActionQuality {
  int frames = 0;
  double worst_key = 0.0;       ///< cost of the least comfortable key (ChooseKeys)
  double hand_error_rad = 0.0;  ///< maximum unattainable wrist rotation
  double shortfall_m = 0.0;     ///< maximum shortfall of an arm
  double penetrating = 0.0;     ///< fraction of frames with a holding hand over 2 mm in the object
  double deepest_mm = 0.0;      ///< maximum of those hands over all frames
  double contact = 0.0;         ///< fraction of held frames in which a holding hand is in contact
  double object_in_body_mm = 0.0;  ///< deepest skin of head, trunk, upper arms, legs in the object
  double hand_in_head_mm = 0.0;    ///< deepest skin of a hand in the head
  double arm_in_trunk_mm = 0.0;    ///< deepest skin of a hand or forearm in the trunk
  double beyond_limits = 0.0;      ///< fraction of joints and frames (MeasureQuality)
  double skate = 0.0;              ///< fraction of frames (MeasureQuality)
  double max_acceleration = 0.0;   ///< of any joint, m/s^2
  double slipped_mm = 0.0;         ///< of the object in the hand, between grasp and fit
};

struct ActionClip {
  Clip clip;  ///< with action, object track (without mesh name) and holding_hand
  ActionQuality quality;
  std::string fault;   ///< brief reason for rejection; empty if accepted
  std::string detail;  ///< the reason with numbers
};

struct ActionClipRequest {
  std::string_view action;
  const ActionActor& actor;
  const ActionProp& prop;  ///< mirrored if `mirrored` is set
  const ActionGrasps& grasps;
  const StandingStart& start;
  bool mirrored = false;  ///< a left-handed clip: synthesized right-handed, then mirrored
  std::uint64_t seed = 1;
  bool wrist_blows = false;  ///< as in ActionScene
};

/// Synthesizes one clip: script, grasp and key selection, whole body, object and finger fit
/// (FitClip), quality measures. Deterministic for the request.
ActionClip MakeActionClip(const ActionClipRequest& request);

/// Synthesizes the first frame of such a clip: the object upright on a table, or in the hand if
/// `in_hand` (empty: random), with the most suitable grasp; fingers and object are those of the
/// grasp, not fitted. Of the quality, only `worst_key`, `hand_error_rad` and `shortfall_m` are set.
/// Without a fault the clip has action, object track, holding_hand and the table, if any.
ActionClip MakeActionStart(const ActionClipRequest& request, std::optional<bool> in_hand);

}  // namespace holdfast
