// SPDX-License-Identifier: MIT
#include "solver/markers/keypoint_hand.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>

#include <ceres/gradient_checker.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/body/default_hand.h"
#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;

// A hand that opens, closes and turns; positions of its keypoints (63 x T), meters.
struct MovingHand {
  explicit MovingHand(Side side, int frames = 120, double size = 1.0)
      : model(DefaultHand(side), {}, side), axes(model), keypoints(axes) {
    for (int t = 0; t < frames; ++t) {
      const double phase = 2.0 * std::numbers::pi * t / 90.0;
      HandAngles angles = axes.Relaxed();
      for (int j = 0; j < kJointsPerHand; ++j) {
        angles(0, j) += (0.35 + 0.3 * std::sin(phase + j / 3)) * (j < 3 * kThumb ? 1.0 : 0.4);
        if (j % 3 == 0) angles(1, j) += 0.12 * std::sin(0.7 * phase + j);
      }
      fingers.push_back(axes.PoseOf(axes.Clamp(angles)));
      turns.push_back(
          Eigen::AngleAxisd(0.8 * std::sin(phase), Eigen::Vector3d(1, 2, 0).normalized()) *
          Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()));
      KeypointHand::Points points;
      keypoints.Evaluate(fingers.back(), points, nullptr);
      const Eigen::Vector3d wrist(0.2 * std::sin(phase), 0.3, 1.0 + 0.1 * std::cos(phase));
      wrists.push_back(wrist);
      points = ((size * turns.back().toRotationMatrix()) * points).colwise() + wrist;
      positions.conservativeResize(3 * kNumKeypoints, t + 1);
      positions.col(t) = points.reshaped();
    }
  }

  HandModel model;
  HandAxes axes;
  KeypointHand keypoints;
  std::vector<FingerPose> fingers;
  std::vector<Eigen::Quaterniond> turns;
  std::vector<Eigen::Vector3d> wrists;
  Eigen::MatrixXd positions;
};

Eigen::MatrixXd WithNoise(Eigen::MatrixXd positions, double sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, sigma);
  for (double& x : positions.reshaped()) x += noise(random);
  return positions;
}

KeypointTable TableOf(const Eigen::MatrixXd& positions, const KeypointOrder& order) {
  KeypointTable table;
  table.points = order.count;
  table.positions.setZero(3 * order.count, positions.cols());
  for (int k = 0; k < kNumKeypoints; ++k) {
    table.positions.middleRows<3>(3 * order.source[static_cast<std::size_t>(k)]) =
        positions.middleRows<3>(3 * k);
  }
  return table;
}

// Mean distance of the fitted keypoints from the true ones, at their size, millimeters.
double MeanError(const SolvedKeypoints& solved, const MovingHand& hand,
                 const Eigen::MatrixXd& truth) {
  const HandModel model(DefaultHand(solved.report.side), {}, solved.report.side);
  const Eigen::Vector3d rest = model.Surface().RestJoints().col(0);
  double sum = 0.0;
  for (int t = 0; t < solved.clip.NumFrames(); ++t) {
    const JointPose& pose = solved.clip.pose[static_cast<std::size_t>(t)];
    KeypointHand::Points points;
    hand.keypoints.Evaluate(FingersOf(pose, solved.report.side), points, nullptr);
    const Eigen::Vector3d wrist = rest + solved.clip.trans.col(t);
    points = ((solved.report.size_ratio * ExpSO3(pose.col(0))) * points).colwise() + wrist;
    sum += (points - truth.col(t).reshaped(3, kNumKeypoints)).colwise().norm().mean();
  }
  return 1e3 * sum / solved.clip.NumFrames();
}

TEST(KeypointTerm, JacobianIsRight) {
  const MovingHand hand(Side::kRight, 2);
  KeypointTerm term(hand.keypoints, 200.0);
  Eigen::VectorXd targets = hand.positions.col(1);
  targets.segment<3>(9).setConstant(std::numeric_limits<double>::quiet_NaN());
  term.SetTargets(targets);
  RotationManifold manifold;
  const std::vector<const ceres::Manifold*> manifolds = {&manifold, nullptr, nullptr};
  ceres::GradientChecker checker(&term, &manifolds, ceres::NumericDiffOptions());
  Eigen::Quaterniond turn = hand.turns[0];
  Eigen::Vector3d place(0.1, 0.2, 0.9);
  FingerPose fingers = hand.fingers[0] + 0.1 * FingerPose::Random();
  const double* parameters[] = {turn.coeffs().data(), place.data(), fingers.data()};
  ceres::GradientChecker::ProbeResults results;
  EXPECT_TRUE(checker.Probe(parameters, 1e-6, &results)) << results.error_log;
}

TEST(SolveKeypoints, FindsOrderSideUnitAndSize) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const MovingHand hand(side, 40, 1.1);
    for (const KeypointOrder& order : KeypointOrders()) {
      SCOPED_TRACE(order.name);
      const Eigen::MatrixXd centimeters = 100.0 * WithNoise(hand.positions, 0.003, 5);
      const SolvedKeypoints solved =
          SolveKeypoints({TableOf(centimeters, order)}, KeypointOptions(), "hand.npy");
      EXPECT_EQ(solved.report.side, side);
      EXPECT_EQ(solved.report.order, order.name);
      EXPECT_EQ(solved.report.meters_per_unit, 0.01);
      EXPECT_NEAR(solved.report.size_ratio, 1.1, 0.03);
      EXPECT_LT(solved.report.rms_mm, 0.7 * solved.report.other_rms_mm);
      EXPECT_LT(MeanError(solved, hand, hand.positions), 5.0);
    }
  }
}

TEST(SolveKeypoints, FiveMillimetersOfNoise) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const MovingHand hand(side, 300, 0.93);
    const Eigen::MatrixXd noisy = WithNoise(hand.positions, 0.005, 1);
    const SolvedKeypoints solved =
        SolveKeypoints({TableOf(noisy, KeypointOrders()[0])}, KeypointOptions(), "hand.npy");
    const double raw =
        1e3 * (noisy - hand.positions).reshaped(3, kNumKeypoints * 300).colwise().norm().mean();
    const double error = MeanError(solved, hand, hand.positions);
    RecordProperty("error_mm", std::to_string(error));
    RecordProperty("raw_mm", std::to_string(raw));
    EXPECT_LT(error, 6.0);
  }
}

TEST(SolveKeypoints, GapsAreFilledAndTwoHandsToldApart) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  MovingHand hand(Side::kRight, 60);
  const MovingHand left(Side::kLeft, 60);
  Eigen::MatrixXd seen = hand.positions;
  seen.middleCols(20, 5).setConstant(nan);
  seen.block(0, 40, 3, 1).setConstant(nan);  // no wrist
  const KeypointTable right = TableOf(seen, KeypointOrders()[0]);
  const KeypointTable other = TableOf(left.positions, KeypointOrders()[0]);
  const SolvedKeypoints solved = SolveKeypoints({other, right}, KeypointOptions(), "hands.npy");
  EXPECT_EQ(solved.report.side, Side::kRight);
  EXPECT_EQ(solved.report.gaps, 5);
  EXPECT_LT(MeanError(solved, hand, hand.positions), 3.0);
  KeypointOptions options;
  options.side = Side::kLeft;
  EXPECT_LT(MeanError(SolveKeypoints({other, right}, options, "hands.npy"), left, left.positions),
            3.0);
}

TEST(SolveKeypoints, UpTurnsTheWorld) {
  const MovingHand hand(Side::kRight, 10);
  KeypointOptions options;
  options.up = UpAxis::kMinusY;
  const std::vector<KeypointTable> tables = {TableOf(hand.positions, KeypointOrders()[0])};
  const Clip up = SolveKeypoints(tables, options, "hand.npy").clip;
  const Eigen::Vector3d rest = hand.model.Surface().RestJoints().col(0);
  const Eigen::Vector3d wrist = rest + up.trans.col(0), source = hand.wrists[0];
  EXPECT_LT((wrist - Eigen::Vector3d(source.x(), source.z(), -source.y())).norm(), 0.01);
}

TEST(SolveKeypoints, FaultsAreNamed) {
  const MovingHand hand(Side::kRight, 3);
  const auto fault = [](const KeypointTable& table, const KeypointOptions& options) {
    return testing::ErrorText([&] { SolveKeypoints({table}, options, "hand.npy"); });
  };
  const KeypointTable table = TableOf(hand.positions, KeypointOrders()[0]);
  KeypointOptions options;
  options.order = &KeypointOrders()[3];
  EXPECT_THAT(fault(table, options), HasSubstr("has 21 points a frame, not the 26"));
  KeypointTable huge = table;
  huge.positions *= 1e6;
  EXPECT_THAT(fault(huge, {}), HasSubstr("--meters-per-unit"));
  huge.positions.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(fault(huge, {}), HasSubstr("no frame with 6 keypoints"));
}

TEST(ReadHandKeypoints, ArraysAndPointsOfJson) {
  const testing::TemporaryFolder folder;
  const auto frame = [](double x) {
    std::string text = "[";
    for (int k = 0; k < kNumKeypoints; ++k) {
      text += (k > 0 ? "," : "") + std::string("{\"x\": ") + std::to_string(x + k) +
              ", \"y\": 0.5, \"z\": 0}";
    }
    return text + "]";
  };
  std::ofstream(folder / "points.json")
      << "{\"landmarks\": [" << frame(0) << ", null, [], " << frame(100) << "]}";
  const std::vector<KeypointTable> tables = ReadHandKeypoints(folder / "points.json");
  ASSERT_EQ(tables.size(), 1);
  ASSERT_EQ(tables[0].positions.cols(), 4);
  EXPECT_TRUE(std::isnan(tables[0].positions(0, 1)));
  EXPECT_TRUE(std::isnan(tables[0].positions(62, 2)));
  EXPECT_EQ(tables[0].positions(3 * 20, 3), 120.0);
  EXPECT_EQ(tables[0].positions(1, 0), 0.5);
  std::ofstream(folder / "one.json") << frame(7);
  EXPECT_EQ(ReadHandKeypoints(folder / "one.json").at(0).positions(0, 0), 7.0);
  std::ofstream(folder / "other.json") << R"({"a": [[1, 2, 3]], "b": 1})";
  EXPECT_THAT(testing::ErrorText([&] { ReadHandKeypoints(folder / "other.json"); }),
              HasSubstr("it has a, b"));
}

}  // namespace
}  // namespace holdfast
