// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/sole_contact.h"

namespace holdfast {

struct FootLiftOptions {
  double lift_m = 0.27;         ///< of the higher of heel and ball, in a long stride
  double long_stride_m = 0.8;   ///< shorter ones are lifted in proportion
  double least_stride_m = 0.3;  ///< what is shorter is no stride
  double most_bend_rad = 0.7;   ///< of the knee, added
};

/// Feet that hardly leave the ground are lifted as those of people who walk: in a step of a foot
/// while the other carries, the knee bends more, so that the heel comes up behind; nothing changes
/// at either end of the step, nor where the foot is high already. `contacts` as FindSupports has
/// them, as long as `frames`.
void LiftFeet(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
              const std::vector<SoleBits>& contacts, std::vector<BodyFrame>& frames,
              const FootLiftOptions& options = {});

}  // namespace holdfast
