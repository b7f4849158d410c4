// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// How well arms could follow a hand.
struct HandOntoBodyReport {
  double mean_missing_mm = 0.0;  ///< distance of the wrists, over all frames
  double max_missing_mm = 0.0;
  int frames_out_of_reach = 0;  ///< more than a millimetre away
};

/// Gives a body the motion of a hand alone (MANO): in each frame the body's wrist goes to where the
/// hand's root is in the world, by the arm's joints alone (MoveWrist), and the fingers become the
/// hand's. The rest of the body stays. `hand` must move `hand_model` with `hand_betas`; `body` is
/// changed in place. Throws Error when the clips differ in length.
HandOntoBodyReport PutHandOntoBody(const Clip& hand, const BodyModel& hand_model,
                                   const Eigen::VectorXd& hand_betas, const BodyModel& body_model,
                                   const Eigen::VectorXd& body_betas, Clip& body);

}  // namespace holdfast
