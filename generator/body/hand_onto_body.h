// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/retarget/convert_parameters.h"

namespace holdfast {

/// How well arms could follow a hand.
struct HandOntoBodyReport {
  double mean_missing_mm = 0.0;  ///< distance of the wrists, over all frames
  double max_missing_mm = 0.0;
  int frames_out_of_reach = 0;  ///< more than a millimeter away
};

/// Gives a body the motion of a hand alone (MANO): in each frame the body's wrist goes to where the
/// hand's root is in the world, by the arm's joints alone (MoveWrist), and the fingers become the
/// hand's. The rest of the body stays. `hand` must move `hand_model` with `hand_betas`; `body` is
/// changed in place. Throws Error when the clips differ in length.
HandOntoBodyReport PutHandOntoBody(const Clip& hand, const BodyModel& hand_model,
                                   const Eigen::VectorXd& hand_betas, const BodyModel& body_model,
                                   const Eigen::VectorXd& body_betas, Clip& body);

/// A clip in another model's parameters.
struct Conversion : ConvertedClip {
  std::optional<HandOntoBodyReport> arms;  ///< of a hand alone that was put onto a body
};

/// What ConvertClip cannot do, a hand alone to a body: `onto`, the motion of `person`, with its
/// wrist and fingers where `hand` (a clip of `from`) has them (PutHandOntoBody), its object and
/// holding_hand. Throws Error as PutHandOntoBody does.
Conversion ConvertOntoBody(const Clip& hand, const ClipBody& from, Clip onto,
                           const ClipBody& person);

/// {"residual": {"joints": {name: {mean_mm, max_mm}}, mean_mm, max_mm, and of vertices where both
/// models have the same}, "arm": {frames_out_of_reach, max_missing_mm} after ConvertOntoBody,
/// "not_carried_over": [text, ...]}.
nlohmann::json ConversionJson(const Conversion& conversion);

}  // namespace holdfast
