// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/motion_style.h"
#include "generator/walk_statistics/power_spectrum.h"

namespace holdfast {

const std::array<StyleMeasureInfo, kNumStyleMeasures>& StyleMeasures() {
  static constexpr std::array<StyleMeasureInfo, kNumStyleMeasures> kMeasures = {{
      {"left_planted_ratio", "Feet", "left foot planted", "", 0.05, true,
       "Share of moving frames with the left heel or ball on the ground (below 4 cm, slower than "
       "0.35 m/s)"},
      {"right_planted_ratio", "Feet", "right foot planted", "", 0.05, true,
       "The same of the right foot"},
      {"both_planted_ratio", "Feet", "both planted", "", 0.05, true,
       "Share of moving frames with both feet on the ground"},
      {"none_planted_ratio", "Feet", "none planted", "", 0.02, true,
       "Share of moving frames with no foot on the ground: in the air, or sliding"},
      {"stance_s", "Feet", "stance", "s", 0.05, true,
       "Median duration of the stances that begin and end in the motion"},
      {"step_length_m", "Feet", "step length", "m", 0.05, true,
       "Half the median way of a foot from one stance to its next, of strides of 30 cm or more"},
      {"step_frequency_hz", "Feet", "step frequency", "Hz", 0.1, true,
       "Two over the median time between touch-downs of one foot, of the same strides"},
      {"walk_ratio_m_per_hz", "Feet", "step length by frequency", "m/Hz", 0.03, true,
       "Step length over step frequency: much the same, about 0.4, for a person who walks at any "
       "speed (Sekiya and Nagasaki 1998); small where somebody shuffles"},
      {"foot_lift_m", "Feet", "foot lift", "m", 0.02, true,
       "Median over strides of the greatest height of the higher of heel and ball"},
      {"contact_drift_m", "Feet", "drift of a contact", "m", 0.005, false,
       "Mean over contacts of a heel or ball of the farthest that it gets from where the contact "
       "began, along the ground"},
      {"contact_drift_p95_m", "Feet", "drift, 95th percentile", "m", 0.01, false,
       "95th percentile of the same"},
      {"skating_ratio", "Feet", "FS", "", 0.02, false,
       "Share of pairs of frames in which the lowest vertex of the body moves along the ground by "
       "more than 2/3 cm"},
      {"skating_joints_ratio", "Feet", "FS, foot joints", "", 0.02, false,
       "The same with the lowest of ankles and balls of the feet"},
      {"airborne_ratio", "Feet", "both over 12 cm", "", 0.005, false,
       "Share of frames in which ankles and balls of both feet are above 12 cm"},
      {"sole_depth_m", "Feet", "sole below ground", "m", 0.005, false,
       "Mean over frames of the depth of the lowest of heels and balls below the ground"},
      {"sole_depth_p99_m", "Feet", "below ground, 99th percentile", "m", 0.01, false,
       "99th percentile of the same"},
      {"speed_moving_m_s", "Way", "speed while moving", "m/s", 0.1, true,
       "Mean speed of the pelvis along the ground in moving frames"},
      {"speed_p95_m_s", "Way", "speed, 95th percentile", "m/s", 0.1, true,
       "95th percentile of the pelvis's speed along the ground, of all frames"},
      {"speed_peak_m_s", "Way", "speed, peak", "m/s", 0.1, true, "Its greatest value"},
      {"speeding_ratio", "Way", "over 2 m/s", "", 0.005, false,
       "Share of frames with the pelvis faster than 2 m/s along the ground"},
      {"fastest_fifth_ratio", "Way", "way in the fastest fifth", "", 0.05, true,
       "Share of the way until arrival that is made in the fastest fifth of that time: 0.2 for an "
       "even walk, 1 for a rush"},
      {"half_way_ratio", "Way", "half way at", "", 0.05, true,
       "Share of the time until arrival after which half of that way is made: 0.5 for an even "
       "walk, "
       "more for a late rush"},
      {"pelvis_bob_m", "Way", "bob of the pelvis", "m", 0.003, true,
       "Standard deviation of the pelvis's height about its mean over a stride, in moving frames"},
      {"heading_off_deg", "Way", "heading off the way", "deg", 3.0, true,
       "Mean angle of the pelvis's heading and the direction in which it travels, in moving "
       "frames"},
      {"sideways_ratio", "Way", "goes sideways", "", 0.03, true,
       "Share of moving frames in which that angle is above 45 degrees"},
      {"turn_rate_p95_deg_s", "Way", "turn rate, 95th percentile", "deg/s", 10.0, false,
       "95th percentile of the rate at which the heading turns, over a quarter of a second"},
      {"arm_swing_left_m", "Body", "arm swing, left", "m", 0.02, true,
       "Amplitude with which the left wrist goes to and fro along the heading, against the middle "
       "of the shoulders: root of two times its standard deviation about its mean over a stride, "
       "in "
       "moving frames"},
      {"arm_swing_right_m", "Body", "arm swing, right", "m", 0.02, true, "The same of the right"},
      {"arm_leg_correlation", "Body", "arms with opposite legs", "", 0.1, true,
       "Correlation of that and the same of the opposite ankle, against the pelvis; mean of both "
       "sides: 1 in step, -1 with the leg of its own side"},
      {"lean_moving_deg", "Body", "lean of the trunk, moving", "deg", 2.0, true,
       "Mean angle of pelvis to neck and the vertical, in moving frames"},
      {"lean_deg", "Body", "lean of the trunk", "deg", 2.0, false, "The same in all frames"},
      {"lean_p95_deg", "Body", "lean, 95th percentile", "deg", 3.0, false,
       "95th percentile of the same"},
      {"acceleration_m_s2", "Motion", "acceleration", "m/s2", 0.5, false,
       "Mean over frames and the 22 joints, second differences"},
      {"acceleration_p99_m_s2", "Motion", "acceleration, 99th percentile", "m/s2", 2.0, false,
       "99th percentile of the same"},
      {"jerk_m_s3", "Motion", "jerk", "m/s3", 10.0, false,
       "Mean over frames and joints, third differences"},
      {"power_0_1_hz_ratio", "Motion", "power, 0 to 1 Hz", "", 0.02, false,
       "Share of the mean square acceleration of all joints in that band (Welch's estimate, Hann "
       "windows of 2.1 s in which at least half of the frames are moving; all windows where none "
       "is)"},
      {"power_1_2_hz_ratio", "Motion", "power, 1 to 2 Hz", "", 0.02, false, "The same"},
      {"power_2_4_hz_ratio", "Motion", "power, 2 to 4 Hz", "", 0.02, false, "The same"},
      {"power_4_8_hz_ratio", "Motion", "power, 4 to 8 Hz", "", 0.02, false, "The same"},
      {"power_8_15_hz_ratio", "Motion", "power, 8 to 15 Hz", "", 0.02, false, "The same"},
      {"beyond_limits_ratio", "Motion", "beyond joint limits", "", 0.002, false,
       "Share of frames and joints turned farther from the rest pose than captured motion is "
       "in all but 0.1 % of its frames, plus 3 degrees"},
      {"beyond_limits_deg", "Motion", "beyond them by", "deg", 2.0, false,
       "Mean angle by which joints are beyond, where they are; 0 where none is"},
      {"hand_way_m", "Hand", "way of the hand", "m", 0.05, false,
       "Straight, from where the hand that gets farther sets out to where 95 % of its farthest "
       "distance from the first frame is made, as the pelvis and its heading have it"},
      {"hand_way_s", "Hand", "time of the hand's way", "s", 0.1, false,
       "From the last frame before its greatest speed with less than a tenth of that"},
      {"hand_peak_m_s", "Hand", "speed of the hand, peak", "m/s", 0.1, false,
       "Greatest speed on that way"},
      {"hand_time_to_peak_ratio", "Hand", "peak at", "", 0.05, false,
       "Share of the time of the way until then: 0.56 for minimum jerk (Flash and Hogan 1985)"},
      {"hand_straightness_ratio", "Hand", "straightness of the hand's way", "", 0.03, false,
       "Straight way over the way made"},
      {"hand_submovements", "Hand", "movements of the hand", "", 0.5, false,
       "Times that speed rises, then falls, by a tenth of its greatest on that way: 1 for minimum "
       "jerk"},
  }};
  return kMeasures;
}

const std::array<StyleCurveInfo, kNumStyleCurves>& StyleCurves() {
  static constexpr std::array<StyleCurveInfo, kNumStyleCurves> kCurves = {{
      {"speed_profile", "Speed of the pelvis on its way", "share of the time until arrival", "m/s",
       0.0, 1.0 / 40.0, 40, false},
      {"power", "Acceleration by frequency", "Hz", "m2/s4 per Hz", 0.0, PowerSpectrum::kStep_Hz, 61,
       false},
      {"speeds", "Speed of the pelvis", "m/s", "share of frames", 0.0, 0.1, 30, true},
      {"headings", "Heading off the way", "degrees", "share of moving frames", 0.0, 7.5, 24, true},
      {"leans", "Lean of the trunk", "degrees", "share of frames", 0.0, 3.0, 30, true},
      {"step_lengths", "Step length", "m", "share of steps", 0.0, 0.05, 24, true},
      {"hand_speed", "Speed of the hand on its way", "share of its time", "share of its greatest",
       0.0, 1.0 / 40.0, 40, false},
  }};
  return kCurves;
}

}  // namespace holdfast
