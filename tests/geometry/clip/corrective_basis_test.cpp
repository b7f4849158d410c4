// SPDX-License-Identifier: MIT
#include "geometry/clip/corrective_basis.h"

#include <random>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

// Smooth motion of every joint: sums of slow sines, up to about a radian.
Clip MakeMotion(int num_frames, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Clip clip;
  clip.trans = Eigen::Matrix3Xd::Zero(3, num_frames);
  clip.pose.resize(num_frames);
  Eigen::Matrix<double, 3, kNumJoints> size, phase, speed;
  for (auto* m : {&size, &phase, &speed}) {
    for (double& x : m->reshaped()) x = uniform(random);
  }
  for (int t = 0; t < num_frames; ++t) {
    clip.pose[t] = 0.6 * size.array() * (5 * phase.array() + 0.05 * t * speed.array()).sin();
  }
  return clip;
}

// Largest distance of the basis from the model's posed rest vertices.
double WorstDistance(const BodySurface& surface, const Clip& clip, const CorrectiveBasis& basis) {
  double worst = 0;
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    const Eigen::VectorXf offset = basis.directions * basis.coefficients.col(t);
    const Eigen::Matrix3Xd made =
        basis.rest + offset.cast<double>().reshaped(3, surface.NumVertices());
    worst = std::max(worst, (made - state.posed_rest).colwise().norm().maxCoeff());
  }
  return worst;
}

class CorrectiveBasisOfDefaultBody : public ::testing::Test {
 protected:
  const BodySurface surface_{BodyModel::Default()};
};

TEST_F(CorrectiveBasisOfDefaultBody, KeepsEveryVertexOfEveryFrameWithinTolerance) {
  const Clip clip = MakeMotion(90, 1);
  Eigen::Index fewer = -1;
  for (const double tolerance_m : {2e-3, 1e-4, 1e-5}) {
    const CorrectiveBasis basis = ComputeCorrectiveBasis(surface_, clip, tolerance_m, 400);
    EXPECT_LE(basis.max_error_m, tolerance_m);
    EXPECT_NEAR(WorstDistance(surface_, clip, basis), basis.max_error_m, 1e-7);
    EXPECT_EQ(basis.rest, surface_.RestVertices());
    EXPECT_EQ(basis.coefficients.cols(), clip.NumFrames());
    EXPECT_GT(basis.Size(), fewer);  // the tighter, the more
    fewer = basis.Size();
    // One direction fewer would not do.
    if (basis.Size() > 0) {
      const CorrectiveBasis smaller =
          ComputeCorrectiveBasis(surface_, clip, tolerance_m, static_cast<int>(basis.Size()) - 1);
      EXPECT_GT(smaller.max_error_m, tolerance_m);
    }
  }
}

TEST_F(CorrectiveBasisOfDefaultBody, TellsTheErrorThatTheCapLeaves) {
  const Clip clip = MakeMotion(60, 3);
  const CorrectiveBasis basis = ComputeCorrectiveBasis(surface_, clip, 1e-6, 3);
  EXPECT_EQ(basis.Size(), 3);
  EXPECT_GT(basis.max_error_m, 1e-6);
  EXPECT_NEAR(WorstDistance(surface_, clip, basis), basis.max_error_m, 1e-7);

  const CorrectiveBasis none = ComputeCorrectiveBasis(surface_, clip, 1e-6, 0);
  EXPECT_EQ(none.Size(), 0);
  EXPECT_NEAR(WorstDistance(surface_, clip, none), none.max_error_m, 1e-7);
}

TEST_F(CorrectiveBasisOfDefaultBody, IsTheSameOnAnyNumberOfThreads) {
  const Clip clip = MakeMotion(50, 4);
  const CorrectiveBasis one = ComputeCorrectiveBasis(surface_, clip, 1e-4, 400, 1);
  for (const int threads : {2, 5}) {
    const CorrectiveBasis many = ComputeCorrectiveBasis(surface_, clip, 1e-4, 400, threads);
    EXPECT_EQ(one.directions, many.directions);
    EXPECT_EQ(one.coefficients, many.coefficients);
    EXPECT_EQ(one.max_error_m, many.max_error_m);
  }
}

TEST_F(CorrectiveBasisOfDefaultBody, CountsFramesThatWereNotSampled) {
  // More frames than are sampled: the error is still that of all of them.
  const Clip clip = MakeMotion(900, 5);
  const CorrectiveBasis basis = ComputeCorrectiveBasis(surface_, clip, 1e-4, 400, 2);
  EXPECT_LE(basis.max_error_m, 1e-4);
  EXPECT_NEAR(WorstDistance(surface_, clip, basis), basis.max_error_m, 1e-7);
}

TEST_F(CorrectiveBasisOfDefaultBody, RestPoseNeedsNoDirections) {
  Clip clip = MakeMotion(5, 6);
  for (JointPose& pose : clip.pose) pose.setZero();
  const CorrectiveBasis basis = ComputeCorrectiveBasis(surface_, clip, 1e-6, 10);
  EXPECT_EQ(basis.Size(), 0);
  EXPECT_EQ(basis.max_error_m, 0.0);
  EXPECT_EQ(basis.coefficients.cols(), 5);
}

TEST_F(CorrectiveBasisOfDefaultBody, RootRotationAndTranslationDoNotMatter) {
  Clip clip = MakeMotion(30, 7);
  const CorrectiveBasis before = ComputeCorrectiveBasis(surface_, clip, 1e-4, 100);
  for (JointPose& pose : clip.pose) pose.col(0) << 1.2, 0.3, -0.4;
  clip.trans.array() += 2.0;
  const CorrectiveBasis after = ComputeCorrectiveBasis(surface_, clip, 1e-4, 100);
  EXPECT_EQ(before.directions, after.directions);
  EXPECT_EQ(before.coefficients, after.coefficients);
}

TEST_F(CorrectiveBasisOfDefaultBody, UnitWeightsShowTheSameSurface) {
  const Clip clip = MakeMotion(40, 9);
  const CorrectiveBasis basis = ComputeCorrectiveBasis(surface_, clip, 1e-5, 400);
  ASSERT_LT(basis.coefficients.minCoeff(), -0.5f);
  const CorrectiveBasis unit = WithUnitWeights(basis);
  EXPECT_EQ(unit.Size(), basis.Size());
  EXPECT_EQ(unit.coefficients.rowwise().minCoeff().cwiseAbs().maxCoeff(), 0.0f);
  EXPECT_EQ(unit.coefficients.rowwise().maxCoeff().minCoeff(), 1.0f);
  EXPECT_LE(unit.coefficients.maxCoeff(), 1.0f);
  EXPECT_NEAR(WorstDistance(surface_, clip, unit), basis.max_error_m, 1e-7);
}

TEST_F(CorrectiveBasisOfDefaultBody, UnitWeightsOfOneFrameAreNone) {
  const Clip clip = MakeMotion(1, 10);
  const CorrectiveBasis basis = ComputeCorrectiveBasis(surface_, clip, 1e-5, 400);
  ASSERT_GT(basis.Size(), 0);
  const CorrectiveBasis unit = WithUnitWeights(basis);
  EXPECT_EQ(unit.Size(), 0);
  EXPECT_LE(WorstDistance(surface_, clip, unit), 1e-5);
}

TEST(CorrectiveBasis, OfAPartOfTheBodyIsOfItsVertices) {
  const auto body = BodyModel::Default();
  const BodySurface hand(body, {}, body->HandVertexIds(Side::kRight));
  const Clip clip = MakeMotion(40, 8);
  const CorrectiveBasis basis = ComputeCorrectiveBasis(hand, clip, 1e-5, 200);
  EXPECT_EQ(basis.directions.rows(), 3 * hand.NumVertices());
  EXPECT_LE(WorstDistance(hand, clip, basis), 1.01e-5);
}

}  // namespace
}  // namespace holdfast
