// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/capture_quality.h"
#include "generator/walk_statistics/reach_faults.h"
#include "generator/wandr/reach_outcome.h"

namespace holdfast {

/// What makes a captured walk look captured, in numbers that any motion has. Frames at 30 Hz, the
/// ground z = 0. *Moving*: the pelvis goes faster than 0.3 m/s along the ground, over half a
/// second. *Arrival*: 95 % of the pelvis's way is done; what is slower than 0.1 m/s makes no way.
enum class StyleMeasure {
  // Feet, of moving frames: heel or ball of a foot on the ground (FindContacts).
  kLeftPlanted,
  kRightPlanted,
  kBothPlanted,
  kNonePlanted,
  // Feet, of steps.
  kStanceSeconds,
  kStepLength,
  kStepFrequency,
  kWalkRatio,
  kFootLift,
  // Feet, of all frames.
  kContactDrift,
  kContactDriftWorst,
  kSkating,
  kSkatingJoints,
  kAirborne,
  kSoleDepth,
  kSoleDepthWorst,
  // The way.
  kSpeedMoving,
  kSpeedHigh,
  kSpeedPeak,
  kSpeeding,
  kFastestFifth,
  kHalfWay,
  kPelvisBob,
  kHeadingOff,
  kHeadingSideways,
  kTurnRate,
  // Arms and trunk.
  kArmSwingLeft,
  kArmSwingRight,
  kArmLegCorrelation,
  kLeanMoving,
  kLean,
  kLeanHigh,
  // How joints move.
  kAcceleration,
  kAccelerationHigh,
  kJerk,
  kPower0To1,
  kPower1To2,
  kPower2To4,
  kPower4To8,
  kPower8To15,
  kBeyondLimits,
  kBeyondLimitsBy,
  // The hand that gets farther from where it was, as the pelvis and its heading have it (HandWay).
  kHandWay,
  kHandSeconds,
  kHandPeak,
  kHandTimeToPeak,
  kHandStraightness,
  kHandSubmovements,
  kCount
};
inline constexpr int kNumStyleMeasures = static_cast<int>(StyleMeasure::kCount);
/// Those before the hand's, which are of any motion.
inline constexpr int kNumBodyMeasures = static_cast<int>(StyleMeasure::kHandWay);

/// A measure, described. The order is that of StyleMeasure.
struct StyleMeasureInfo {
  std::string_view key;         ///< with its unit, "step_length_m"; shares are `_ratio`, in [0, 1]
  std::string_view group;       ///< "Feet", "Way", "Body", "Motion", "Hand"
  std::string_view label;       ///< for people
  std::string_view unit;        ///< of the value: "m", "m/s", "deg", ...; "" for ratios
  double resolution;            ///< smaller differences mean nothing to an eye
  bool of_walks;                ///< asked only of motions that get somewhere
  std::string_view definition;  ///< one sentence
};
const std::array<StyleMeasureInfo, kNumStyleMeasures>& StyleMeasures();

/// How things are spread over time, frequency or size.
enum class StyleCurve {
  kSpeedProfile,  ///< m/s, at shares of the time until arrival
  kPower,         ///< acceleration, m^2/s^4 per Hz, mean of the 22 joints, while moving
  kSpeeds,        ///< share of frames, by pelvis speed, m/s
  kHeadings,      ///< share of moving frames, by angle of heading and travel, degrees
  kLeans,         ///< share of frames, by lean of the trunk, degrees
  kStepLengths,   ///< share of steps, by length, m
  kHandSpeed,     ///< over its greatest, at shares of the time of the hand's way
  kCount
};
inline constexpr int kNumStyleCurves = static_cast<int>(StyleCurve::kCount);

struct StyleCurveInfo {
  std::string_view key, label, x_label, y_label;
  double begin,
      step;  ///< of x: point i stands for begin + (i + 1/2) step; kPower for begin + i step
  int points;
  bool histogram;  ///< y adds up to 1
};
const std::array<StyleCurveInfo, kNumStyleCurves>& StyleCurves();

/// One motion, measured. What it has too little of (no step, too few frames) is NaN, a curve empty.
struct MotionStyle {
  int frames = 0;    ///< measured: those before the first that is not all numbers
  bool cut = false;  ///< there was such a frame
  double way_m = 0;  ///< farthest that the pelvis gets from where it was, along the ground
  std::array<double, kNumStyleMeasures> values;
  std::array<Eigen::VectorXd, kNumStyleCurves> curves;
  ReachFaults faults;

  double operator[](StyleMeasure measure) const {
    return values[static_cast<std::size_t>(measure)];
  }
  const Eigen::VectorXd& operator[](StyleCurve curve) const {
    return curves[static_cast<std::size_t>(curve)];
  }
};

/// Who moves.
struct StyleBody {
  Eigen::Matrix3Xd rest_joints;  ///< (3 x 55) meters
  double sole_y = 0.0;           ///< height of the soles in the rest pose, meters
  /// For kSkating, FS as WANDR has it; without it that is NaN.
  const wandr::LowestPoint* surface = nullptr;
  /// For kBeyondLimits; without it that is NaN.
  const JointLimits* limits = nullptr;
};

MotionStyle MeasureStyle(std::span<const BodyFrame> frames, const StyleBody& body);

}  // namespace holdfast
