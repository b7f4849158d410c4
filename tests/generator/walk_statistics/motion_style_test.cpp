// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/motion_style.h"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/walk_statistics/gait.h"
#include "generator/walk_statistics/power_spectrum.h"
#include "generator/walk_statistics/way_pace.h"
#include "geometry/rotation.h"
#include "tests/generator/test_body.h"
#include "tests/support/walking_figure.h"

namespace holdfast {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

StyleBody Body() { return {DefaultMeasures().rest_joints, DefaultMeasures().sole_y}; }

// Stands upright in the rest pose, soles on the ground, facing -y; moved by `at(t)`.
std::vector<BodyFrame> Carried(int frames, const std::function<Vector3d(int)>& at) {
  std::vector<BodyFrame> motion(static_cast<std::size_t>(frames));
  const BodyMeasures& body = DefaultMeasures();
  for (int t = 0; t < frames; ++t) {
    motion[t].local[0] = AngleAxisd(std::numbers::pi / 2.0, Vector3d::UnitX());
    motion[t].pelvis = Vector3d(0.0, 0.0, body.rest_joints(1, 0) - body.sole_y) + at(t);
  }
  return motion;
}

// Turns `joint` about the body's lateral axis so that `tip`, below it, is `ahead` meters in front.
void Swing(BodyFrame& frame, int joint, int tip, const Quaterniond& before, double ahead) {
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  const Vector3d hanging = before * (rest.col(tip) - rest.col(joint));
  const double radius = std::hypot(hanging.y(), hanging.z());
  const double turn = std::asin(ahead / radius) - std::atan2(hanging.z(), -hanging.y());
  frame.local[joint] = Quaterniond(AngleAxisd(-turn, Vector3d::UnitX())) * before;
}

TEST(MotionStyle, ABodyThatIsCarriedSlides) {
  const double angle = 30.0 * kDegree, speed = 1.2;
  const auto motion = Carried(121, [&](int t) -> Vector3d {
    return Vector3d(std::sin(angle), -std::cos(angle), 0.0) * speed * t / 30.0;
  });
  const MotionStyle style = MeasureStyle(motion, Body());
  EXPECT_EQ(style.frames, 121);
  EXPECT_FALSE(style.cut);
  EXPECT_NEAR(style.way_m, 4.8, 1e-9);
  EXPECT_NEAR(style[StyleMeasure::kSpeedMoving], speed, 1e-9);
  EXPECT_NEAR(style[StyleMeasure::kSpeedHigh], speed, 1e-9);
  EXPECT_NEAR(style[StyleMeasure::kSpeedPeak], speed, 1e-9);
  EXPECT_EQ(style[StyleMeasure::kSpeeding], 0.0);
  EXPECT_NEAR(style[StyleMeasure::kFastestFifth], 0.2, 1e-9);
  EXPECT_NEAR(style[StyleMeasure::kHalfWay], 0.5, 1e-9);
  EXPECT_NEAR(style[StyleMeasure::kHeadingOff], 30.0, 1e-6);
  EXPECT_EQ(style[StyleMeasure::kHeadingSideways], 0.0);
  EXPECT_EQ(style[StyleMeasure::kNonePlanted], 1.0);  // soles at 1.2 m/s hold nothing
  EXPECT_EQ(style[StyleMeasure::kLeftPlanted], 0.0);
  EXPECT_EQ(style[StyleMeasure::kSkatingJoints], 1.0);
  EXPECT_EQ(style[StyleMeasure::kAirborne], 0.0);
  EXPECT_NEAR(style[StyleMeasure::kAcceleration], 0.0, 1e-9);
  EXPECT_NEAR(style[StyleMeasure::kPelvisBob], 0.0, 1e-9);
  EXPECT_TRUE(std::isnan(style[StyleMeasure::kStepLength]));
  EXPECT_TRUE(std::isnan(style[StyleMeasure::kArmLegCorrelation]));
  EXPECT_TRUE(std::isnan(style[StyleMeasure::kSkating]));       // no surface given
  EXPECT_TRUE(std::isnan(style[StyleMeasure::kBeyondLimits]));  // no limits given
  const Eigen::VectorXd& profile = style[StyleCurve::kSpeedProfile];
  ASSERT_EQ(profile.size(), 40);
  EXPECT_LT((profile.array() - speed).abs().maxCoeff(), 1e-9);
  EXPECT_NEAR(style[StyleCurve::kHeadings].sum(), 1.0, 1e-12);
}

TEST(MotionStyle, SidewaysAndTooFast) {
  const auto motion = Carried(61, [&](int t) { return Vector3d(2.5 * t / 30.0, 0.0, 0.0); });
  const MotionStyle style = MeasureStyle(motion, Body());
  EXPECT_EQ(style[StyleMeasure::kSpeeding], 1.0);
  EXPECT_EQ(style[StyleMeasure::kHeadingSideways], 1.0);
  EXPECT_NEAR(style[StyleMeasure::kHeadingOff], 90.0, 1e-6);
}

TEST(MotionStyle, TheSwayOfStepsIsNoDirection) {
  // Straight ahead at 1 m/s, swaying 3 cm to the sides twice a second: up to 21 degrees off.
  const auto motion = Carried(121, [](int t) {
    return Vector3d(0.03 * std::sin(4.0 * std::numbers::pi * t / 30.0), -t / 30.0, 0.0);
  });
  EXPECT_LT(MeasureStyle(motion, Body())[StyleMeasure::kHeadingOff], 2.0);
}

TEST(MotionStyle, FloatsAndSinks) {
  const MotionStyle high =
      MeasureStyle(Carried(60, [](int) { return Vector3d(0.0, 0.0, 0.3); }), Body());
  EXPECT_EQ(high[StyleMeasure::kAirborne], 1.0);
  EXPECT_EQ(high[StyleMeasure::kSoleDepth], 0.0);
  const MotionStyle deep = MeasureStyle(
      Carried(60, [](int t) { return Vector3d(0.0, 0.0, t < 30 ? 0.0 : -0.04); }), Body());
  EXPECT_EQ(deep[StyleMeasure::kAirborne], 0.0);
  EXPECT_NEAR(deep[StyleMeasure::kSoleDepth], 0.02, 1e-9);
  EXPECT_NEAR(deep[StyleMeasure::kSoleDepthWorst], 0.04, 1e-9);
}

TEST(MotionStyle, SurfaceAndLimitsWhereTheyAreGiven) {
  const wandr::LowestPoint surface{BodySurface(BodyModel::Default())};
  auto motion =
      Carried(41, [](int t) { return Vector3d(0.0, t < 21 ? 0.0 : -0.05 * (t - 20), 0.0); });
  JointLimits limits;
  limits.fill(0.5);
  for (int t = 0; t < 10; ++t) motion[t].local[18] = AngleAxisd(0.7, Vector3d::UnitY());
  StyleBody body = Body();
  body.surface = &surface;
  body.limits = &limits;
  const MotionStyle style = MeasureStyle(motion, body);
  EXPECT_DOUBLE_EQ(style[StyleMeasure::kSkating], 0.5);
  EXPECT_NEAR(style[StyleMeasure::kBeyondLimits], 10.0 / (41.0 * 21.0), 1e-12);
  EXPECT_NEAR(style[StyleMeasure::kBeyondLimitsBy], 0.2 / kDegree, 1e-6);
}

TEST(MotionStyle, ArmsSwingAsFarAsTheyDo) {
  // A stride in the air, of 33 frames: nobody can tell how long it is, so it counts as usual.
  const auto swinging = [](double left_sign) {
    auto motion = Carried(133, [](int t) { return Vector3d(0.0, -1.0 * t / 30.0, 1.0); });
    for (int t = 0; t < 133; ++t) {
      const double phase = std::sin(2.0 * std::numbers::pi * t / 33.0);
      const Quaterniond hang_right(AngleAxisd(1.4, Vector3d::UnitZ()));
      const Quaterniond hang_left(AngleAxisd(-1.4, Vector3d::UnitZ()));
      Swing(motion[t], 17, 21, hang_right, 0.15 * phase);
      Swing(motion[t], 16, 20, hang_left, left_sign * 0.25 * phase);
      Swing(motion[t], 1, 7, Quaterniond::Identity(), 0.3 * phase);
      Swing(motion[t], 2, 8, Quaterniond::Identity(), -0.3 * phase);
    }
    return MeasureStyle(motion, Body());
  };
  const MotionStyle walk = swinging(-1.0);
  EXPECT_NEAR(walk[StyleMeasure::kArmSwingRight], 0.15, 0.002);
  EXPECT_NEAR(walk[StyleMeasure::kArmSwingLeft], 0.25, 0.003);
  EXPECT_NEAR(walk[StyleMeasure::kArmLegCorrelation], 1.0, 1e-3);
  // The left arm with the left leg: in step on one side, against it on the other.
  EXPECT_NEAR(swinging(1.0)[StyleMeasure::kArmLegCorrelation], 0.0, 1e-3);
}

TEST(MotionStyle, LeansAndTurns) {
  auto motion = Carried(91, [](int) -> Vector3d { return Vector3d::Zero(); });
  const double upright = MeasureStyle(motion, Body())[StyleMeasure::kLean];
  for (int t = 0; t < 91; ++t) {
    // 20 degrees ahead, turning by 60 degrees in a second.
    motion[t].local[0] = AngleAxisd(60.0 * kDegree * t / 30.0, Vector3d::UnitZ()) *
                         AngleAxisd(20.0 * kDegree, Vector3d::UnitX()) * motion[t].local[0];
  }
  const MotionStyle style = MeasureStyle(motion, Body());
  EXPECT_NEAR(std::abs(style[StyleMeasure::kLean] - 20.0), upright, 0.2);
  EXPECT_NEAR(style[StyleMeasure::kLeanHigh], style[StyleMeasure::kLean], 1e-6);
  EXPECT_NEAR(style[StyleMeasure::kTurnRate], 60.0, 1e-6);
  EXPECT_TRUE(std::isnan(style[StyleMeasure::kLeanMoving]));
  EXPECT_TRUE(std::isnan(style[StyleMeasure::kHeadingOff]));
}

TEST(MotionStyle, FindsTheStepsOfAWalk) {
  const Clip clip = testing::WalkingFigure(DefaultMeasures(), 240, 1.0);
  const MotionStyle style = MeasureStyle(BodyFrames(clip, DefaultMeasures().rest_joints), Body());
  EXPECT_NEAR(style[StyleMeasure::kStepFrequency], 2.0, 0.05);
  EXPECT_NEAR(style[StyleMeasure::kStepLength], 0.5, 0.02);
  EXPECT_NEAR(style[StyleMeasure::kWalkRatio], 0.25, 0.015);
  EXPECT_GT(style[StyleMeasure::kLeftPlanted], 0.35);
  EXPECT_GT(style[StyleMeasure::kFootLift], 0.03);
  EXPECT_LT(style[StyleMeasure::kNonePlanted], 0.25);
  EXPECT_NEAR(style[StyleMeasure::kHalfWay], 0.5, 0.02);
  EXPECT_LT(style[StyleMeasure::kHeadingOff], 1.0);
}

TEST(MotionStyle, OfAccelerationByFrequency) {
  // All of the body to and fro, 5 times a second, 2 cm: 22 joints alike.
  const double omega = 2.0 * std::numbers::pi * 5.0;
  const auto motion =
      Carried(151, [&](int t) { return Vector3d(0.02 * std::sin(omega * t / 30.0), 0.0, 0.0); });
  const MotionStyle style = MeasureStyle(motion, Body());
  EXPECT_GT(style[StyleMeasure::kPower4To8], 0.98);
  EXPECT_LT(style[StyleMeasure::kPower1To2], 0.005);
  // Second differences of a sine: 4 sin^2(w/2) of it. Mean square of a sine: half.
  const double amplitude = 0.02 * 4.0 * std::pow(std::sin(omega / 60.0), 2) * 900.0;
  const double power = style[StyleCurve::kPower].sum() * PowerSpectrum::kStep_Hz;
  EXPECT_NEAR(power, 0.5 * amplitude * amplitude, 0.02 * power);
}

TEST(MotionStyle, StopsAtWhatIsNoNumber) {
  auto motion = Carried(50, [](int t) { return Vector3d(0.0, -0.03 * t, 0.0); });
  motion[40].pelvis.x() = std::numeric_limits<double>::quiet_NaN();
  const MotionStyle style = MeasureStyle(motion, Body());
  EXPECT_TRUE(style.cut);
  EXPECT_EQ(style.frames, 40);
  EXPECT_NEAR(style[StyleMeasure::kSpeedMoving], 0.9, 1e-9);
}

TEST(MotionStyle, ShortMotionsHaveWhatTheyHave) {
  const auto motion = Carried(20, [](int t) { return Vector3d(0.0, -0.03 * t, 0.0); });
  const MotionStyle none = MeasureStyle({}, Body());
  EXPECT_EQ(none.frames, 0);
  for (const double value : none.values) EXPECT_TRUE(std::isnan(value));
  const MotionStyle one = MeasureStyle(std::span(motion).first(1), Body());
  EXPECT_TRUE(std::isnan(one[StyleMeasure::kSpeedPeak]));
  EXPECT_TRUE(std::isnan(one[StyleMeasure::kSkatingJoints]));
  EXPECT_EQ(one[StyleMeasure::kAirborne], 0.0);
  const MotionStyle two = MeasureStyle(std::span(motion).first(2), Body());
  EXPECT_NEAR(two[StyleMeasure::kSpeedPeak], 0.9, 1e-9);
  EXPECT_TRUE(std::isnan(two[StyleMeasure::kAcceleration]));
  const MotionStyle short_one = MeasureStyle(std::span(motion).first(10), Body());
  EXPECT_EQ(short_one[StyleCurve::kPower].size(), 0);
  EXPECT_TRUE(std::isnan(short_one[StyleMeasure::kPower0To1]));
  EXPECT_NEAR(short_one[StyleMeasure::kAcceleration], 0.0, 1e-9);
}

TEST(WayPace, ALateRushShows) {
  // Five seconds of swaying, then 2 m/s for one.
  std::vector<double> speeds(180, 0.05);
  std::fill(speeds.begin() + 150, speeds.end(), 2.0);
  const WayPace rush = MeasurePace(speeds, 10);
  EXPECT_EQ(rush.arrival, 179);  // 95 % of 30 frames' way are 28.5 of them
  EXPECT_DOUBLE_EQ(rush.fastest_fifth_ratio, 1.0);
  EXPECT_NEAR(rush.half_way_ratio, (150.0 + 14.5) / 179.0, 1e-12);
  EXPECT_DOUBLE_EQ(rush.profile[0], 0.0);
  EXPECT_DOUBLE_EQ(rush.profile[9], 2.0);
  EXPECT_NEAR(rush.profile.mean(), 2.0 * 29.0 / 179.0, 1e-12);
  // Who stands when there is nothing more to do does not rush.
  std::ranges::reverse(speeds);
  const WayPace early = MeasurePace(speeds, 10);
  EXPECT_EQ(early.arrival, 29);
  EXPECT_DOUBLE_EQ(early.half_way_ratio, 0.5);
  EXPECT_NEAR(early.fastest_fifth_ratio, 0.2, 1e-12);
  // 20 frames at 4 m/s and 72 of 80 at 1 m/s make 95 % of the way: 92 frames, a fifth is 18.4.
  std::vector<double> uneven(100, 1.0);
  std::fill(uneven.begin(), uneven.begin() + 20, 4.0);
  EXPECT_NEAR(MeasurePace(uneven, 10).fastest_fifth_ratio, 18.4 * 4.0 / 152.0, 1e-12);

  const WayPace none = MeasurePace(std::vector<double>(30, 0.09), 10);
  EXPECT_EQ(none.arrival, 0);
  EXPECT_TRUE(std::isnan(none.half_way_ratio));
  EXPECT_EQ(none.profile.size(), 0);
}

TEST(Gait, HowFarAContactDrifts) {
  // The left heel slides by 3 mm a frame for 31 frames, there and back again, the ball stays; the
  // right foot is in the air.
  std::vector<Soles> soles(61, Soles::Zero());
  std::vector<SoleBits> contacts(61, 0);
  for (int t = 0; t < 61; ++t) {
    soles[t].col(0).x() = 0.003 * std::min(t, 60 - t);
    soles[t].col(1).y() = 0.2;
    soles[t].row(2).tail<2>().setConstant(0.2);
    contacts[t] = t < 50 ? 0b0011 : 0b0010;
  }
  EXPECT_THAT(ContactDrifts(contacts, soles),
              ::testing::ElementsAre(::testing::DoubleNear(0.09, 1e-12), 0.0));
  const std::vector<Stance> stances = FindStances(contacts, soles);
  ASSERT_EQ(stances.size(), 1u);
  EXPECT_EQ(stances[0].side, Side::kLeft);
  EXPECT_EQ(stances[0].Frames(), 61);
}

TEST(Gait, StridesLeadFromStanceToStance) {
  std::vector<Soles> soles(90, Soles::Zero());
  std::vector<SoleBits> contacts(90, 0);
  for (int t = 0; t < 90; ++t) {
    const int phase = t % 30, stride = t / 30;
    const bool stands = phase < 18;
    contacts[t] = stands ? kRightSole : 0;
    soles[t].block<1, 2>(1, 2).setConstant(-0.8 * (stride + (stands ? 0.0 : (phase - 17) / 12.0)));
    if (!stands) soles[t](2, 3) = 0.01 * (phase - 17);
  }
  const std::vector<Stride> strides = FindStrides(FindStances(contacts, soles), soles, 30.0);
  ASSERT_EQ(strides.size(), 2u);
  EXPECT_TRUE(std::isnan(strides[0].duration_s));  // touched down before the motion began
  EXPECT_DOUBLE_EQ(strides[1].duration_s, 1.0);
  for (const Stride& stride : strides) {
    EXPECT_NEAR(stride.length_m, 0.8, 1e-12);
    EXPECT_NEAR(stride.height_m, 0.12, 1e-12);
    EXPECT_EQ(stride.touch_down - stride.lift_off, 12);
  }
  EXPECT_TRUE(FindStrides(FindStances(contacts, soles), soles, 30.0, 0.9).empty());
}

TEST(PowerSpectrum, SumsToTheMeanSquare) {
  // 3 sin(2 Hz) in one channel, 4 sin(6 Hz) in another: mean squares 4.5 and 8.
  for (const int samples : {50, 64, 301}) {
    Eigen::MatrixXd signals(2, samples);
    for (int t = 0; t < samples; ++t) {
      signals(0, t) = 3.0 * std::sin(2.0 * std::numbers::pi * 2.0 * t / 30.0 + 0.3);
      signals(1, t) = 4.0 * std::sin(2.0 * std::numbers::pi * 6.0 * t / 30.0);
    }
    const PowerSpectrum power = EstimatePower(signals, 30.0);
    EXPECT_EQ(power.density.size(), 61);
    EXPECT_NEAR(power.Power(0.0, 4.0), 4.5, 0.15) << samples;
    EXPECT_NEAR(power.Power(4.0, 15.0), 8.0, 0.25) << samples;
    Eigen::Index top = 0;
    power.density.maxCoeff(&top);
    EXPECT_DOUBLE_EQ(power.FrequencyAt(top), 6.0);
  }
}

TEST(PowerSpectrum, WindowsOfNoWeightDoNotCount) {
  Eigen::MatrixXd signals(1, 256);
  std::vector<double> weights(256, 0.0);
  for (int t = 0; t < 256; ++t) {
    const double hertz = t < 128 ? 2.0 : 8.0;
    signals(0, t) = std::sin(2.0 * std::numbers::pi * hertz * t / 30.0);
    weights[t] = t < 128 ? 1.0 : 0.0;
  }
  const PowerSpectrum first = EstimatePower(signals, 30.0, weights);
  EXPECT_GT(first.Power(0.0, 4.0), 2.0 * first.Power(4.0, 15.0));
  const PowerSpectrum all = EstimatePower(signals, 30.0);
  EXPECT_NEAR(all.Power(0.0, 4.0) / all.Power(4.0, 15.0), 1.0, 0.05);
  // Of frames 96 to 160, a quarter has weight: too little.
  signals.setZero();
  signals.middleCols(130, 20).setOnes();
  std::fill(weights.begin() + 112, weights.begin() + 128, 0.0);
  EXPECT_EQ(EstimatePower(signals, 30.0, weights).density.maxCoeff(), 0.0);
  // With no window of weight, all of them.
  const PowerSpectrum any = EstimatePower(signals, 30.0, std::vector<double>(256, 0.0));
  EXPECT_GT(any.density.maxCoeff(), 0.0);
  EXPECT_LT((any.density - EstimatePower(signals, 30.0).density).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(EstimatePower(signals.leftCols(15), 30.0).density.size(), 0);
}

TEST(StyleMeasures, AreAllDescribed) {
  std::vector<std::string_view> keys;
  for (const StyleMeasureInfo& info : StyleMeasures()) {
    EXPECT_FALSE(info.label.empty()) << info.key;
    EXPECT_FALSE(info.definition.empty()) << info.key;
    EXPECT_GT(info.resolution, 0.0) << info.key;
    EXPECT_THAT(keys, ::testing::Not(::testing::Contains(info.key)));
    keys.push_back(info.key);
  }
  EXPECT_EQ(keys[static_cast<std::size_t>(StyleMeasure::kAirborne)], "airborne_ratio");
  EXPECT_EQ(keys[static_cast<std::size_t>(StyleMeasure::kBeyondLimitsBy)], "beyond_limits_deg");
  EXPECT_EQ(keys[static_cast<std::size_t>(StyleMeasure::kPower4To8)], "power_4_8_hz_ratio");
}

}  // namespace
}  // namespace holdfast
