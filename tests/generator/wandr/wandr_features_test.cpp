// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"
#include "tests/support/wandr_scene.h"

namespace holdfast::wandr {
namespace {

using testing::DefaultBones;
using testing::NumericGradient;
using testing::Perturbed;
using testing::RandomPose;
using testing::RelativeError;

Eigen::VectorXd Draw(nn::RandomStream& random, int size) {
  return Eigen::VectorXd::NullaryExpr(size, [&] { return 2.0 * random.Uniform() - 1.0; });
}

// Z = Rz(a) as a matrix, by the Euler angle of the definition.
Eigen::Matrix3d HeadingMatrix(const Pose<double>& pose) {
  const Eigen::Matrix3d& R = pose.rotation[0];
  return Eigen::AngleAxisd(std::atan2(R(1, 0), R(0, 0)), Eigen::Vector3d::UnitZ()).matrix();
}

TEST(Rotation6d, GramSchmidtKeepsRotationsAndItsDerivative) {
  nn::RandomStream random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Matrix3d R = ExpSO3(3.0 * Draw(random, 3));
    EXPECT_LT((RotationFromRows12<double>(Rows12<double>(R)) - R).norm(), 1e-14);
    const Vector6<double> six = Rows12<double>(R) + 0.5 * Draw(random, 6);
    const Eigen::Matrix3d at = RotationFromRows12<double>(six);
    EXPECT_LT((at * at.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(at.determinant(), 1.0, 1e-14);
    const Eigen::Vector3d psi_bar = Draw(random, 3);
    const auto value = [&](const Eigen::VectorXd& step) {
      const Eigen::Matrix3d moved = RotationFromRows12<double>(six + step);
      return psi_bar.dot(LogSO3(at.transpose() * moved));
    };
    EXPECT_LT(RelativeError(RotationFromRows12Vjp<double>(six, psi_bar), NumericGradient(value, 6)),
              1e-8);
  }
}

TEST(Heading, IsTheEulerAngleOfTheRootAndTheBodyFacesMinusY) {
  nn::RandomStream random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Pose<double> pose = RandomPose(random, 1.0);
    const Heading<double> heading = HeadingOf<double>(pose.rotation[0]);
    const Eigen::Matrix3d Z = HeadingMatrix(pose);
    const Eigen::Vector3d v = Draw(random, 3);
    EXPECT_LT((heading.ToWorld(v) - Z * v).norm(), 1e-14);
    EXPECT_LT((heading.FromWorld(v) - Z.transpose() * v).norm(), 1e-14);
    EXPECT_LT((heading.Forward() + Z.col(1)).norm(), 1e-14);
    const Eigen::Matrix3d R_xy = WithoutHeading<double>(heading, pose.rotation[0]);
    EXPECT_LT((R_xy - Z.transpose() * pose.rotation[0]).norm(), 1e-14);
    EXPECT_EQ(R_xy(1, 0), 0.0);

    const auto azimuth = [&](const Eigen::VectorXd& step) {
      const Eigen::Matrix3d R = Z.transpose() * pose.rotation[0] * ExpSO3(step);
      return std::atan2(R(1, 0), R(0, 0));
    };
    EXPECT_LT(RelativeError(heading.gradient, NumericGradient(azimuth, 3)), 1e-8);
  }
  const Pose<double> standing = StandingPose(testing::DefaultBody());
  EXPECT_LT((HeadingOf<double>(standing.rotation[0]).Forward() + Eigen::Vector3d::UnitY()).norm(),
            1e-12);
}

TEST(BodyKinematics, IsTheBodyModels) {
  nn::RandomStream random(3);
  const Eigen::Matrix3Xd& rest = testing::DefaultBody().rest_joints;
  for (int trial = 0; trial < 10; ++trial) {
    const Pose<double> pose = RandomPose(random, 1.0);
    JointPose angles = JointPose::Zero();
    for (int k = 0; k < kNumBodyJoints; ++k) angles.col(k) = LogSO3(pose.rotation[k]);
    BodyState state;
    ForwardJoints(rest, angles, pose.translation, state);
    BodyKinematics<double> kinematics;
    ForwardKinematics(DefaultBones(), pose, kinematics);
    EXPECT_LT((kinematics.joints - state.joints.leftCols<kNumBodyJoints>()).norm(), 1e-12);
    for (const Side side : {Side::kRight, Side::kLeft}) {
      EXPECT_LT(
          (WristPosition(DefaultBones(), pose, side) - kinematics.joints.col(WristJoint(side)))
              .norm(),
          1e-13);
    }
    BodyKinematics<float> single;
    ForwardKinematics(DefaultBones().Cast<float>(), pose.Cast<float>(), single);
    EXPECT_LT((single.joints.cast<double>() - kinematics.joints).cwiseAbs().maxCoeff(), 3e-6);
  }
}

TEST(BodyKinematics, VectorJacobianProductIsTheDerivative) {
  nn::RandomStream random(4);
  const Pose<double> pose = RandomPose(random, 1.0);
  const Eigen::VectorXd numbers = Draw(random, kJointNumbers);
  const BodyJoints<double> joints_bar = Eigen::Map<const BodyJoints<double>>(numbers.data());
  BodyKinematics<double> kinematics;
  ForwardKinematics(DefaultBones(), pose, kinematics);
  TangentVector<double> found = TangentVector<double>::Zero();
  ForwardKinematicsVjp<double>(kinematics, joints_bar, found);
  const auto value = [&](const Eigen::VectorXd& step) {
    BodyKinematics<double> moved;
    ForwardKinematics(DefaultBones(), Perturbed(pose, step), moved);
    return moved.joints.cwiseProduct(joints_bar).sum();
  };
  EXPECT_LT(RelativeError(found, NumericGradient(value, kTangentSize)), 1e-8);
}

TEST(PoseDelta, CarriesOnePoseToTheNextAndForgetsWhereItIs) {
  nn::RandomStream random(5);
  for (int trial = 0; trial < 10; ++trial) {
    const Pose<double> a = RandomPose(random), b = RandomPose(random);
    const StateVector<double> delta = DeltaBetween(a, b);
    // The definition, in matrices.
    EXPECT_LT(
        (delta.head<3>() - HeadingMatrix(a).transpose() * (b.translation - a.translation)).norm(),
        1e-13);
    Pose<double> next;
    ApplyDelta<double>(a, HeadingOf<double>(a.rotation[0]), delta, next);
    EXPECT_LT((StateOf(next) - StateOf(b)).norm(), 1e-12);
    // The same motion elsewhere, turned by any angle, has the same delta.
    const Eigen::Vector3d by = Draw(random, 3), pelvis = testing::DefaultBody().rest_joints.col(0);
    const double turn = 6.0 * random.Uniform();
    const StateVector<double> there =
        DeltaBetween(Moved(a, turn, by, pelvis), Moved(b, turn, by, pelvis));
    EXPECT_LT((there - delta).norm(), 1e-12);
  }
}

TEST(PoseDelta, VectorJacobianProductIsTheDerivative) {
  nn::RandomStream random(6);
  for (int trial = 0; trial < 5; ++trial) {
    const Pose<double> pose = RandomPose(random);
    const StateVector<double> delta = RestDelta<double>() + 0.2 * Draw(random, kStateSize);
    const TangentVector<double> next_bar = Draw(random, kTangentSize);
    Pose<double> at;
    ApplyDelta<double>(pose, HeadingOf<double>(pose.rotation[0]), delta, at);
    const auto along = [&](const Pose<double>& from, const StateVector<double>& d) {
      Pose<double> next;
      ApplyDelta<double>(from, HeadingOf<double>(from.rotation[0]), d, next);
      double sum = next_bar.head<3>().dot(next.translation);
      for (int k = 0; k < kNumBodyJoints; ++k) {
        const Eigen::Matrix3d change = at.rotation[k].transpose() * next.rotation[k];
        sum += next_bar.segment<3>(TangentOf(k)).dot(LogSO3(change));
      }
      return sum;
    };
    TangentVector<double> pose_bar = TangentVector<double>::Zero();
    StateVector<double> delta_bar = StateVector<double>::Constant(NAN);
    ApplyDeltaVjp<double>(HeadingOf<double>(pose.rotation[0]), delta, next_bar, pose_bar,
                          delta_bar);
    EXPECT_LT(RelativeError(pose_bar, NumericGradient(
                                          [&](const Eigen::VectorXd& step) {
                                            return along(Perturbed(pose, step), delta);
                                          },
                                          kTangentSize)),
              1e-7);
    EXPECT_LT(
        RelativeError(
            delta_bar,
            NumericGradient([&](const Eigen::VectorXd& step) { return along(pose, delta + step); },
                            kStateSize)),
        1e-7);
  }
}

// I^w, I^p, I^r from their formulas, with matrices.
Eigen::Matrix<double, 9, 1> PaperIntention(const Pose<double>& pose,
                                           const FrameGoal<double>& goal) {
  const Eigen::Matrix3d Z = HeadingMatrix(pose);
  BodyKinematics<double> kinematics;
  ForwardKinematics(DefaultBones(), pose, kinematics);
  const Eigen::Vector3d P = kinematics.joints.col(0), W = kinematics.joints.col(21);
  Eigen::Matrix<double, 9, 1> I;
  I.head<3>() = Z.transpose() * (goal.position - W) / (goal.frames_left / 30.0 + 1e-5);
  const Eigen::Vector3d e = Z.transpose() * (goal.position - P);
  I.segment<3>(3) = 2.0 * (1.0 - std::exp(-e.norm())) * e / e.norm();
  I[5] = 0.0;
  Eigen::Vector3d towards = goal.position - P;
  towards.z() = 0.0;
  const Eigen::Vector3d h = -Z.col(1);
  I.tail<3>() = Z.transpose() * (towards.normalized() - h);
  return I;
}

IntentionBody<double> Seen(const Pose<double>& pose) {
  return {HeadingOf<double>(pose.rotation[0]), pose.translation + DefaultBones().offset.col(0),
          WristPosition(DefaultBones(), pose, Side::kRight)};
}

TEST(Intention, IsThePapersInBothForms) {
  nn::RandomStream random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const Pose<double> pose = RandomPose(random);
    const FrameGoal<double> goal{true, 3.0 * Draw(random, 3), 1.0 + 240.0 * random.Uniform(), {}};
    Eigen::VectorXd found = Eigen::VectorXd::Constant(9, NAN);
    WriteIntention(IntentionLayout::kPaper, Seen(pose), goal, found.data());
    EXPECT_LT((found - PaperIntention(pose, goal)).norm(), 1e-10 * found.norm());
    EXPECT_NEAR(found[5], 0.0, 1e-14);
    EXPECT_NEAR(found[8], 0.0, 1e-14);

    Eigen::VectorXd flagged(10), bounded(13);
    WriteIntention(IntentionLayout::kFlagged, Seen(pose), goal, flagged.data());
    EXPECT_EQ(flagged.head<9>(), found);
    EXPECT_EQ(flagged[9], 1.0);
    WriteIntention(IntentionLayout::kBounded, Seen(pose), goal, bounded.data());
    EXPECT_LE(bounded.head<3>().norm(), 2.0);
    EXPECT_GT(bounded.head<3>().dot(found.head<3>()),
              0.999 * bounded.head<3>().norm() * found.head<3>().norm());
    EXPECT_EQ(bounded[12], 1.0);
  }
}

TEST(Intention, WithoutAGoalIsZero) {
  nn::RandomStream random(8);
  for (const IntentionLayout layout :
       {IntentionLayout::kPaper, IntentionLayout::kFlagged, IntentionLayout::kBounded}) {
    Eigen::VectorXd found = Eigen::VectorXd::Constant(IntentionSize(layout), NAN);
    WriteIntention(layout, Seen(RandomPose(random)), FrameGoal<double>{}, found.data());
    EXPECT_EQ(found, Eigen::VectorXd::Zero(found.size()));
  }
}

TEST(Intention, IsFiniteAtAndAboveThePelvis) {
  const Pose<double> pose = StandingPose(testing::DefaultBody());
  for (const double height : {0.0, 0.5}) {
    const IntentionBody<double> body = Seen(pose);
    const FrameGoal<double> goal{true, body.pelvis + height * Eigen::Vector3d::UnitZ(), 10.0, {}};
    Eigen::VectorXd found(9);
    WriteIntention(IntentionLayout::kPaper, body, goal, found.data());
    EXPECT_TRUE(found.allFinite());
    EXPECT_EQ(found.tail<3>(), Eigen::VectorXd::Zero(3)) << "no turn is asked for";
    IntentionBar<double> bar;
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(9);
    WriteIntentionVjp(IntentionLayout::kPaper, body, goal, ones.data(), bar);
    EXPECT_TRUE(bar.pelvis.allFinite() && bar.wrist.allFinite() && std::isfinite(bar.turn));
  }
}

TEST(Intention, VectorJacobianProductIsTheDerivative) {
  nn::RandomStream random(9);
  for (const IntentionLayout layout :
       {IntentionLayout::kPaper, IntentionLayout::kFlagged, IntentionLayout::kBounded}) {
    for (int trial = 0; trial < 6; ++trial) {
      const Pose<double> pose = RandomPose(random);
      const FrameGoal<double> goal{true, 2.0 * Draw(random, 3), 1.0 + 60.0 * random.Uniform(), {}};
      const int size = IntentionSize(layout);
      const Eigen::VectorXd weights = Draw(random, size);
      const auto value = [&](const Pose<double>& at, const FrameGoal<double>& wanted) {
        Eigen::VectorXd out(size);
        WriteIntention(layout, Seen(at), wanted, out.data());
        return weights.dot(out);
      };
      IntentionBar<double> bar;
      WriteIntentionVjp(layout, Seen(pose), goal, weights.data(), bar);
      BodyKinematics<double> kinematics;
      ForwardKinematics(DefaultBones(), pose, kinematics);
      BodyJoints<double> joints_bar = BodyJoints<double>::Zero();
      joints_bar.col(0) = bar.pelvis;
      joints_bar.col(21) = bar.wrist;
      TangentVector<double> found = TangentVector<double>::Zero();
      ForwardKinematicsVjp<double>(kinematics, joints_bar, found);
      found.segment<3>(3) += bar.turn * HeadingOf<double>(pose.rotation[0]).gradient;
      EXPECT_LT(RelativeError(found, NumericGradient(
                                         [&](const Eigen::VectorXd& step) {
                                           return value(Perturbed(pose, step), goal);
                                         },
                                         kTangentSize)),
                1e-7);
      EXPECT_LT(RelativeError(bar.goal, NumericGradient(
                                            [&](const Eigen::VectorXd& step) {
                                              FrameGoal<double> moved = goal;
                                              moved.position += step;
                                              return value(pose, moved);
                                            },
                                            3)),
                1e-7);
    }
  }
}

TEST(Condition, PoseFeaturesAreNormalizedStateWithoutTheHeading) {
  nn::RandomStream random(10);
  const Statistics statistics = testing::WalkingStatistics();
  const Normalizer<double> normalizer(statistics);
  const Pose<double> pose = RandomPose(random);
  const Heading<double> heading = HeadingOf<double>(pose.rotation[0]);
  Eigen::VectorXd found(kPoseFeatures);
  WritePoseFeatures(pose, heading, normalizer, found.data());
  EXPECT_NEAR(found[0], (pose.translation.z() - 0.1) / (0.2 + 1e-5), 1e-12);
  const Eigen::Matrix3d R_xy = HeadingMatrix(pose).transpose() * pose.rotation[0];
  const Vector6<double> six =
      (Rows12<double>(R_xy) - statistics.body_orient_xy.mean)
          .cwiseQuotient((statistics.body_orient_xy.deviation.array() + 1e-5).matrix());
  EXPECT_NEAR(found[1], six[0], 1e-12);
  EXPECT_NEAR(found[6], six[5], 1e-12);
  EXPECT_EQ(found[4], 0.0) << "its deviation is 0: rounding must not be divided by it";
  EXPECT_NEAR(found[kPoseFeatures - 1],
              (pose.rotation[21](1, 2) - statistics.body_pose.mean[125]) / (0.25 + 1e-5), 1e-12);
  // It is the same wherever and whichever way the body stands.
  Eigen::VectorXd there(kPoseFeatures);
  const Pose<double> moved =
      Moved(pose, 2.0, {3.0, -1.0, 0.0}, testing::DefaultBody().rest_joints.col(0));
  WritePoseFeatures(moved, HeadingOf<double>(moved.rotation[0]), normalizer, there.data());
  EXPECT_LT((there - found).norm(), 1e-10);

  const Eigen::VectorXd weights = Draw(random, kPoseFeatures);
  TangentVector<double> bar = TangentVector<double>::Zero();
  WritePoseFeaturesVjp<double>(pose, heading, normalizer, weights.data(), bar);
  const auto value = [&](const Eigen::VectorXd& step) {
    const Pose<double> at = Perturbed(pose, step);
    Eigen::VectorXd out(kPoseFeatures);
    WritePoseFeatures(at, HeadingOf<double>(at.rotation[0]), normalizer, out.data());
    return weights.dot(out);
  };
  EXPECT_LT(RelativeError(bar, NumericGradient(value, kTangentSize)), 1e-7);
}

TEST(Condition, HasTheLayoutOfThePaper) {
  EXPECT_EQ(ConditionSize(IntentionLayout::kPaper), 277);
  EXPECT_EQ(kPreviousDeltaOf, 133);
  EXPECT_EQ(kIntentionOf, 268);
}

}  // namespace
}  // namespace holdfast::wandr
