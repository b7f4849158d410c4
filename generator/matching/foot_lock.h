// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/leg_placement.h"
#include "generator/matching/sole_contact.h"

namespace holdfast {

struct FootLockOptions {
  /// Soles are at least that high half-way between two stances: where the motion shuffles, higher
  /// than it has them.
  double clearance_m = 0.0;
  /// The pelvis sinks no farther than that for legs to reach; a foot that is still out of reach is
  /// drawn in along the ground.
  double most_sink_m = std::numeric_limits<double>::infinity();
  /// The first frame stays as it is, for a motion that goes on from somewhere.
  bool keep_first = false;
};

/// How much of a change frame `frame` gets where the first stays as it is (`keep_first`): none of
/// it then, all of it from the tenth on.
double FadeIn(int frame);

struct FootLockReport {
  double max_correction_m = 0.0;  ///< greatest way that a planted foot was moved
  int at_frame = 0;               ///< that of the greatest correction
  double max_sink_m = 0.0;        ///< greatest sinking of the pelvis for legs to reach
  double max_missed_m = 0.0;      ///< greatest distance of an ankle from its place at the end
};

/// Feet that are on the ground stay where they are on the ground. While a sole point is in contact
/// (the ball, else the heel) its horizontal motion is taken out of the foot, and the lower of the
/// two is put on z = 0; each stance is moved as a whole as little as possible. In the air the
/// correction passes from one stance to the next by a minimum-jerk blend, and soles stay above the
/// ground. A planted foot that the motion drags farther than 5 cm makes a small step instead, while
/// the other carries. Legs follow by two-bone inverse kinematics, the pelvis sinks where they would
/// not reach.
///
/// Looks ahead: it is for whole motions. `contacts` as long as `frames`. Returns where the feet of
/// every frame are afterwards.
std::vector<FeetTarget> LockFeet(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
                                 const std::vector<SoleBits>& contacts,
                                 std::vector<BodyFrame>& frames,
                                 const FootLockOptions& options = {},
                                 FootLockReport* report = nullptr);

}  // namespace holdfast
