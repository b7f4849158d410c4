// SPDX-License-Identifier: MIT
#include "solver/body_ik/reach_warp.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "generator/matching/foot_lock.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/body_ik/reach_clip.h"
#include "solver/unknowns/change_spline.h"
#include "tests/generator/test_body.h"
#include "tests/support/numeric_jacobian.h"
#include "tests/support/walking_figure.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;
using testing::FigureLibrary;
using testing::JacobianError;
using testing::ReachingFigure;

const Eigen::Matrix3Xd& Rest() { return DefaultMeasures().rest_joints; }

JointLimits WideLimits() {
  JointLimits limits;
  limits.fill(3.0);
  return limits;
}

std::vector<BodyFrame> Reach() {
  return BodyFrames(ReachingFigure(DefaultMeasures(), 91, 0.8), Rest());
}

// Every scale 1, so that no term hides behind another; hinges on the side where they act.
ReachFrameTerms PlainTerms(const UpperBodyChain& chain, const BodyFrame& frame) {
  ReachFrameTerms terms;
  terms.wrist = {Vector3d(0.3, -0.5, 1.2), 1.0};
  terms.gaze.sigma = 1.0;
  const FeetTarget feet = FeetOf(Place(Rest(), frame));
  terms.legs.ankle = feet.ankle;
  terms.legs.longest = {0.2, 0.2};
  terms.legs.shortest = 2.0;
  terms.legs.sigma_m = 1.0;
  terms.balance.sigma_m = 1.0;
  terms.range = JointRange::Of(chain, frame, WideLimits());
  terms.range.limit.fill(0.01);
  terms.range.highest_elbow = -1.0;
  terms.range.sigma_rad = 1.0;
  return terms;
}

class ReachTerms : public ::testing::TestWithParam<Side> {};

TEST_P(ReachTerms, HaveTheJacobiansOfCentralDifferences) {
  const UpperBodyChain chain(Rest(), GetParam());
  const BodyFrame frame = Reach()[35];
  const ReachFrameTerms terms = PlainTerms(chain, frame);
  const Eigen::Vector4d basis(0.1, 0.5, 0.35, 0.05);
  const ReachFrameBlock block(chain, frame, terms, basis);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 0.3);
  for (const double scale : {0.0, 1e-8, 1.0, 3.0}) {
    std::array<UpperBodyChange, 4> knots;
    for (UpperBodyChange& knot : knots) {
      knot = scale * UpperBodyChange::NullaryExpr([&] { return normal(random); });
    }
    EXPECT_LT(
        JacobianError(block, {knots[0].data(), knots[1].data(), knots[2].data(), knots[3].data()},
                      {}, 1e-6),
        1e-6)
        << scale;
  }
}

TEST_P(ReachTerms, VanishWhereTheCaptureIsWhatIsWanted) {
  const UpperBodyChain chain(Rest(), GetParam());
  const BodyFrame frame = Reach()[35];
  const BodyPlacement placed = Place(Rest(), frame);
  ReachFrameTerms terms;
  terms.wrist.target = placed.joints.col(chain.WristJointId());
  terms.gaze.wanted = placed.rotation[15].col(2);
  const FeetTarget feet = FeetOf(placed);
  terms.legs.ankle = feet.ankle;
  terms.legs.longest = {1.0, 1.0};
  terms.balance.captured = Balance::Middle(chain, placed);
  terms.range = JointRange::Of(chain, frame, WideLimits());
  const ReachFrameBlock block(chain, frame, terms, Eigen::Vector4d(0.1, 0.5, 0.35, 0.05));
  const UpperBodyChange zero = UpperBodyChange::Zero();
  const Eigen::VectorXd residuals =
      testing::ResidualsAt(block, {zero.data(), zero.data(), zero.data(), zero.data()});
  EXPECT_LT(residuals.cwiseAbs().maxCoeff(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Sides, ReachTerms, ::testing::Values(Side::kRight, Side::kLeft));

TEST(ChangeSplinePrior, HasTheJacobianOfCentralDifferences) {
  const ChangeSplinePrior prior(UpperBodyChange::LinSpaced(0.5, 2.0), 0.5);
  std::array<UpperBodyChange, 3> knots;
  for (std::size_t k = 0; k < 3; ++k) knots[k].setLinSpaced(-1.0, 0.2 * static_cast<double>(k));
  EXPECT_LT(JacobianError(prior, {knots[0].data(), knots[1].data(), knots[2].data()}, {}, 1e-6),
            1e-8);
}

TEST(WarpReach, BringsTheWristToTheGoalAndLeavesFeetAndAllElse) {
  const std::vector<BodyFrame> captured = Reach();
  const std::vector<FeetTarget> feet = FeetOf(Place(Rest(), captured));
  const Vector3d wrist = Place(Rest(), captured[45]).joints.col(21);
  for (const Vector3d& off : {Vector3d(0.15, 0.0, 0.1), Vector3d(-0.1, 0.1, -0.25),
                              Vector3d(0.0, -0.12, 0.15), Vector3d(0.0, 0.0, 0.0)}) {
    ReachWarp warp;
    warp.goal = wrist + off;
    warp.frame = 45;
    warp.begin = 15;
    warp.end = 76;
    ReachWarpOptions options;
    options.joint_limits = WideLimits();
    std::vector<BodyFrame> frames = captured;
    const ReachWarpReport report = WarpReach(Rest(), feet, warp, options, frames);
    EXPECT_LT(report.wrist_error_m, 0.005) << off.transpose();
    EXPECT_LT(report.max_missed_m, 0.003) << off.transpose();
    double jerkiest = 0.0;
    for (int t = 0; t < 91; ++t) {
      const BodyPlacement placed = Place(Rest(), frames[t]);
      for (const int ankle : {7, 8}) {
        EXPECT_LT((placed.joints.col(ankle) - feet[t].ankle[ankle - 7]).norm(), 0.003);
      }
      if (t < warp.begin || t >= warp.end) {
        EXPECT_EQ((frames[t].pelvis - captured[t].pelvis).norm(), 0.0);
      }
      if (t > 0 && t < 90) {
        const auto wrist_at = [&](int s) -> Vector3d {
          return Place(Rest(), frames[s]).joints.col(21);
        };
        jerkiest =
            std::max(jerkiest, (wrist_at(t + 1) - 2 * wrist_at(t) + wrist_at(t - 1)).norm() * 900);
      }
    }
    EXPECT_LT(jerkiest, 12.0) << "m/s^2, at the seams too";
  }
}

TEST(WarpReach, RefusesAWindowWithoutTime) {
  std::vector<BodyFrame> frames = Reach();
  const std::vector<FeetTarget> feet = FeetOf(Place(Rest(), frames));
  ReachWarp warp;
  warp.frame = 20;
  warp.begin = 15;
  warp.end = 60;
  EXPECT_THROW(WarpReach(Rest(), feet, warp, ReachWarpOptions(), frames), Error);
}

TEST(MakeReachClip, ReachesItsLabelsAndIsTheSameForASeed) {
  const MotionLibrary library = FigureLibrary(DefaultMeasures());
  ReachClipOptions options;
  options.synthesis.reaches = 2;
  options.warp.joint_limits = WideLimits();
  const ReachClip clip = MakeReachClip(library, options, 3);
  const ReachClip again = MakeReachClip(library, options, 3);
  ASSERT_EQ(clip.labels.size(), 2u);
  for (const ReachLabel& label : clip.labels) {
    const BodyPlacement placed = Place(Rest(), clip.frames[label.frame]);
    EXPECT_LT((placed.joints.col(21) - label.goal).norm(), 0.01);
  }
  ASSERT_EQ(again.frames.size(), clip.frames.size());
  for (std::size_t t = 0; t < clip.frames.size(); ++t) {
    ASSERT_TRUE(again.frames[t].pelvis == clip.frames[t].pelvis);
    ASSERT_TRUE(again.frames[t].local[17].coeffs() == clip.frames[t].local[17].coeffs());
  }
}

TEST(MakeReachClip, AsCapturedGoalsAreWhereTheWristIs) {
  const MotionLibrary library = FigureLibrary(DefaultMeasures());
  ReachClipOptions options;
  options.carry_to_goals = false;
  options.warp.joint_limits = WideLimits();
  const ReachClip clip = MakeReachClip(library, options, 3);
  for (const ReachLabel& label : clip.labels) {
    EXPECT_FALSE(label.warped);
    EXPECT_EQ(label.error_m, 0.0);
  }
}

}  // namespace
}  // namespace holdfast
