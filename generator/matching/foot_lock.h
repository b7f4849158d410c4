// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/retarget/ground_contact.h"

namespace holdfast {

/// World poses of both feet in one frame: left, right.
struct FeetTarget {
  std::array<Eigen::Vector3d, 2> ankle;
  std::array<Eigen::Matrix3d, 2> rotation;  ///< of the ankle joints; the toe bend is kept
};

FeetTarget FeetOf(const BodyPlacement& placed);
std::vector<FeetTarget> FeetOf(std::span<const BodyPlacement> placed);

/// Solves both legs so that the feet reach their targets; each knee stays on its side. Returns the
/// larger distance between an ankle and its target (0: both reached), meters.
double PlaceLegs(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet, BodyFrame& frame);

/// Moves ankle targets that the legs cannot reach towards the hip: by at most 4 cm in height, and
/// for the rest along the ground, since higher feet would no longer stand. Returns the larger
/// displacement, meters.
double DrawIntoReach(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame, FeetTarget& feet);

/// Returns how far the pelvis must be lowered in each frame for both legs to reach with the knees
/// bent by at least 3 degrees. Smoothed over neighboring frames. Meters, not negative.
std::vector<double> PelvisSink(const Eigen::Matrix3Xd& rest_joints,
                               const std::vector<BodyFrame>& frames,
                               const std::vector<FeetTarget>& feet);

/// Heels and balls of the feet in the order of GroundProbe: left heel, left ball, right heel, right
/// ball. One column each, world meters.
using Soles = Eigen::Matrix<double, 3, GroundProbe::kNumSoles>;

/// Computes heels and balls of a placed body whose rest pose stands on `floor_y`.
class SolePoints {
 public:
  SolePoints(const Eigen::Matrix3Xd& rest_joints, double floor_y);
  Soles At(const BodyPlacement& placed) const;
  std::vector<Soles> At(std::span<const BodyPlacement> placed) const;

 private:
  Soles offset_;  // in the frame of the point's joint
};

/// Contact bits of one frame: bit i is set if sole point i is on the ground.
using SoleBits = std::uint8_t;
inline constexpr SoleBits kLeftSole = 0b0011, kRightSole = 0b1100;

/// Returns the contacts of every frame: points lower than 4 cm and slower than 0.35 m/s along the
/// ground for at least 3 frames at 30 Hz. Gaps of up to 2 frames are closed.
std::vector<SoleBits> FindContacts(std::span<const Soles> soles, double frame_rate);

struct FootLockOptions {
  /// Minimum height of the soles half-way between two stances. Lower swings are raised to it.
  double clearance_m = 0.0;
  /// Maximum lowering of the pelvis for the legs to reach. A foot that is still out of reach is
  /// pulled in along the ground.
  double most_sink_m = std::numeric_limits<double>::infinity();
  /// Keeps the first frame unchanged, for a motion that continues another one.
  bool keep_first = false;
};

/// Returns the fraction of a change applied in frame `frame` if the first frame is kept
/// (`keep_first`): 0 in the first frame, 1 from the tenth on.
double FadeIn(int frame);

struct FootLockReport {
  double max_correction_m = 0.0;  ///< largest displacement of a planted foot
  double max_sink_m = 0.0;        ///< largest lowering of the pelvis
  double max_missed_m = 0.0;      ///< largest final distance of an ankle from its target
};

/// Pins feet that are in contact with the ground. While a sole point is in contact (the ball,
/// otherwise the heel), its horizontal motion is removed from the foot, and the lower of the two
/// points is put on z = 0; each stance as a whole is moved as little as possible. In the air, the
/// correction blends from one stance to the next by a minimum-jerk curve, and soles stay above the
/// ground. A planted foot that drifts more than 5 cm makes a small step instead, if the other foot
/// is in contact. Legs follow by two-bone inverse kinematics; the pelvis is lowered where the legs
/// would not reach.
///
/// Uses future frames, so it needs the whole motion. `contacts` has one entry per frame. Returns
/// the final feet of every frame.
std::vector<FeetTarget> LockFeet(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
                                 const std::vector<SoleBits>& contacts,
                                 std::vector<BodyFrame>& frames,
                                 const FootLockOptions& options = {},
                                 FootLockReport* report = nullptr);

/// Finds the supporting feet of a motion whose feet may slide, such as the output of a network. At
/// least one foot supports in every frame, even if it slides. The sequence over {left, right, both}
/// minimizes a total cost (Viterbi): a stance foot costs by its height and speed, a swing foot
/// costs a constant, and a change of a foot's state costs a constant. The contact points of a
/// stance foot are those of FindContacts, or else its lowest point.
std::vector<SoleBits> FindSupports(std::span<const Soles> soles, double frame_rate);

}  // namespace holdfast
