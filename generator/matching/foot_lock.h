// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/leg_placement.h"
#include "geometry/retarget/ground_contact.h"

namespace holdfast {

/// Heels and balls of the feet, in the order of GroundProbe: left heel, left ball, right heel,
/// right ball. One column each, world meters.
using Soles = Eigen::Matrix<double, 3, GroundProbe::kNumSoles>;

/// Heels and balls of a placed body whose rest pose stands on `floor_y`.
class SolePoints {
 public:
  SolePoints(const Eigen::Matrix3Xd& rest_joints, double floor_y);
  Soles At(const BodyPlacement& placed) const;
  std::vector<Soles> At(std::span<const BodyPlacement> placed) const;

 private:
  Soles offset_;  // in the joint's frame
};

/// How fast a sole point (column) goes along the ground in frame t, m/s: over both neighbors.
double SpeedAlongGround(std::span<const Soles> soles, double frame_rate, int point, std::size_t t);

/// Bit i of a frame's contacts: sole point i is on the ground.
using SoleBits = std::uint8_t;
inline constexpr SoleBits kLeftSole = 0b0011, kRightSole = 0b1100;

/// Contacts of every frame: a point lower than 4 cm and slower than 0.35 m/s along the ground, in
/// runs of at least 3 frames at 30 Hz; gaps of up to 2 are closed.
std::vector<SoleBits> FindContacts(std::span<const Soles> soles, double frame_rate);

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

/// Contacts of a motion whose feet may slide, as networks make them: in every frame one foot at
/// least carries, the one that is low and slow for longest, however fast it slides. Which feet
/// carry is the cheapest way through {left, right, both} over all frames: a stance foot costs
/// by its height and speed, one that does not by being low and still, a change of feet by itself.
/// The points on the ground of a stance foot are FindContacts's, or else its lowest.
std::vector<SoleBits> FindSupports(std::span<const Soles> soles, double frame_rate);

}  // namespace holdfast
