// SPDX-License-Identifier: MIT
#include "solver/actions/action_motion.h"

#include <array>
#include <random>

#include <gtest/gtest.h>

#include "generator/actions/standing_start.h"
#include "generator/matching/capture_quality.h"
#include "geometry/rotation.h"
#include "solver/actions/action_measures.h"
#include "tests/generator/test_body.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using testing::JacobianError;

const Eigen::Matrix3Xd& Rest() { return DefaultMeasures().rest_joints; }

std::vector<BodyFrame> Idle(int count) {
  return IdleMotion(DefaultMeasures(), OwnStanding(DefaultMeasures(), 3), count);
}

// Every scale 1, so that no term hides behind another; hinges on the side where they act.
ActionFrameTerms PlainTerms(const UpperBodyChain& chain, const BodyFrame& frame, double share) {
  ActionFrameTerms terms;
  terms.hand = {share, Vector3d(0.3, -0.5, 1.2), Vector3d(-0.1, 0.05, 0.2), 1.0};
  terms.gaze.sigma = 1.0;
  terms.lean = {Vector3d(0.1, -0.3, 0.9).normalized(), Vector3d(0.2, -1.0, 0.1).normalized(), 1.0};
  terms.legs.ankle = FeetOf(Place(Rest(), frame)).ankle;
  terms.legs.longest = {0.2, 0.2};
  terms.legs.shortest = 2.0;
  terms.legs.sigma_m = 1.0;
  terms.balance.sigma_m = 1.0;
  JointLimits wide;
  wide.fill(3.0);
  terms.range = JointRange::Of(chain, frame, wide);
  terms.range.limit.fill(0.01);
  terms.range.highest_elbow = -1.0;
  terms.range.sigma_rad = 1.0;
  return terms;
}

TEST(ActionTerms, HaveTheJacobiansOfCentralDifferences) {
  const BodyFrame frame = Idle(20)[10];
  const Eigen::Vector4d basis(0.1, 0.5, 0.35, 0.05);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 0.3);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const UpperBodyChain chain(Rest(), side);
    for (const double share : {0.0, 0.4, 1.0}) {
      const ActionFrameBlock block(chain, frame, PlainTerms(chain, frame, share), basis);
      for (const double scale : {1e-8, 1.0, 3.0}) {
        std::array<UpperBodyChange, 4> knots;
        for (UpperBodyChange& knot : knots) {
          knot = scale * UpperBodyChange::NullaryExpr([&] { return normal(random); });
        }
        EXPECT_LT(JacobianError(
                      block, {knots[0].data(), knots[1].data(), knots[2].data(), knots[3].data()},
                      {}, 1e-6),
                  1e-6)
            << share << " " << scale;
      }
    }
  }
}

TEST(ActionTerms, VanishWhereTheBodyIsAsWanted) {
  const UpperBodyChain chain(Rest(), Side::kRight);
  const BodyFrame frame = Idle(20)[10];
  const BodyPlacement placed = Place(Rest(), frame);
  ActionFrameTerms terms;
  const Vector3d wrist = placed.joints.col(21);
  terms.hand.share = 0.6;
  terms.hand.in_world = wrist;
  terms.hand.in_head = placed.rotation[15].transpose() * (wrist - placed.joints.col(15));
  terms.gaze.wanted = placed.rotation[15].col(2);
  terms.lean.up = placed.rotation[9].col(1);
  terms.lean.forward = placed.rotation[9].col(2);
  terms.legs.ankle = FeetOf(placed).ankle;
  terms.legs.longest = {1.0, 1.0};
  terms.balance.captured = Balance::Middle(chain, placed);
  JointLimits wide;
  wide.fill(3.0);
  terms.range = JointRange::Of(chain, frame, wide);
  const ActionFrameBlock block(chain, frame, terms, Eigen::Vector4d(0.1, 0.5, 0.35, 0.05));
  const UpperBodyChange zero = UpperBodyChange::Zero();
  const Eigen::VectorXd residuals =
      testing::ResidualsAt(block, {zero.data(), zero.data(), zero.data(), zero.data()});
  EXPECT_LT(residuals.cwiseAbs().maxCoeff(), 1e-9);
}

TEST(ActionStance, LeansForwardAndToTheLeft) {
  const Eigen::Matrix3d forward = LeanRotation({0.2, 0.0});
  EXPECT_NEAR((forward * Vector3d::UnitZ()).y(), -std::sin(0.2), 1e-12);
  const Eigen::Matrix3d left = LeanRotation({0.0, 0.2});
  EXPECT_NEAR((left * -Vector3d::UnitY()).x(), std::sin(0.2), 1e-12);
  ActionScript script;
  script.lean = {{0.0, 0.0, 0.1, 0.0}, {1.0, 1.0, 0.3, 0.2}};
  EXPECT_TRUE(LeanAt(script, 0.5).isApprox(Eigen::Vector2d(0.1, 0.0)));
  EXPECT_TRUE(LeanAt(script, 1.5).isApprox(Eigen::Vector2d(0.2, 0.1)));
  EXPECT_TRUE(LeanAt(script, 2.0).isApprox(Eigen::Vector2d(0.3, 0.2)));
}

TEST(MoveActionBody, BringsHandHeadAndChestWhereTheyAreWantedAndLeavesFeet) {
  std::vector<BodyFrame> frames = Idle(90);
  const FeetTarget feet = FeetOf(Place(Rest(), frames.front()));
  const BodyPlacement start = Place(Rest(), frames.front());
  ActionScript script;
  script.duration_s = 89.0 / 30.0;
  script.gaze = {{0.5, 0.8, false, Vector3d(0.3, -1.0, -0.2), 1.0}};
  script.lean = {{0.5, 0.8, 0.15, 0.1}};
  Isometry3d wrist = Isometry3d::Identity();
  wrist.translation() = start.joints.col(21);
  Isometry3d there = wrist;
  there.translation() += Vector3d(0.03, -0.10, 0.06);
  const ActionPath path({{0.0, 0.5, Anchor::kWorld, wrist, Vector3d::Zero()},
                         {1.3, 3.0, Anchor::kWorld, there, Vector3d::Zero()}},
                        {});
  MoveActionBody(Rest(), feet, script, path, 10.0, frames);
  const BodyPlacement end = Place(Rest(), frames.back());
  EXPECT_LT((end.rotation[15].col(2) - Vector3d(0.3, -1.0, -0.2).normalized()).norm(), 0.12);
  EXPECT_LT((end.rotation[9].col(1) - LeanRotation({0.15, 0.1}) * start.rotation[9].col(1)).norm(),
            0.08);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const BodyPlacement placed = Place(Rest(), frames[t]);
    const Vector3d wanted =
        path.At(static_cast<double>(t) / 30.0).At(placed.WorldFromJoint(kHead)).translation();
    EXPECT_LT((placed.joints.col(21) - wanted).norm(), 0.03);
    EXPECT_LT((placed.joints.col(7) - feet.ankle[0]).norm(), 0.002);
    EXPECT_LT((placed.joints.col(8) - feet.ankle[1]).norm(), 0.002);
  }
}

}  // namespace
}  // namespace holdfast
