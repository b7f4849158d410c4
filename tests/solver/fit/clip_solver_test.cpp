// SPDX-License-Identifier: MIT
#include "solver/fit/clip_solver.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_refinement.h"
#include "solver/fit/fit.h"
#include "solver/terms/hand/paper_terms.h"
#include "tests/support/hand_scene.h"

namespace holdfast {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::HandScene;

// The embedded ball with its center at the origin.
TriangleMesh CenteredBall() {
  TriangleMesh ball = ReadMesh(HOLDFAST_MESHES_DIR "/objects/sphere.ply");
  const Vector3d middle =
      0.5 * (ball.vertices.rowwise().minCoeff() + ball.vertices.rowwise().maxCoeff());
  ball.vertices.colwise() -= middle;
  return ball;
}

// A person who walks and turns with an object in the right hand, the object's true pose known.
struct Carried {
  explicit Carried(int frames, bool bend_wrist = false) : mesh(CenteredBall()), surface(mesh) {
    object = MakeFitObject(mesh, surface, {scene.object, {}}, 2);
    object.surface.resize(3, 0);
    const BodySurface joints(scene.model, {}, std::vector<int>{});
    const Vector3d pelvis = joints.RestJoints().col(0);
    clip.frame_rate = 30.0;
    clip.trans.resize(3, frames);
    clip.object.emplace();
    clip.object->trans.setZero(3, frames);
    clip.object->orient.setZero(3, frames);
    for (int t = 0; t < frames; ++t) {
      const Eigen::Matrix3d turn = ExpSO3(Vector3d(0.01 * t, -0.03 * t, 0.08 * t));
      const Vector3d shift(0.03 * t, 0.002 * t * t, 0.02 * std::sin(0.3 * t));
      JointPose pose = scene.pose;
      pose.col(0) = LogSO3(turn * ExpSO3(scene.pose.col(0)));
      if (bend_wrist) pose.col(21) = 0.3 * std::sin(0.4 * t) * Vector3d(0.5, -0.8, 1.0);
      clip.pose.push_back(pose);
      clip.trans.col(t) = turn * (pelvis + scene.trans) + shift - pelvis;
      truth.push_back({Quaterniond(turn) * scene.object_pose.orientation,
                       turn * scene.object_pose.translation + shift});
      clip.object->trans.col(t) = truth[t].translation;
      clip.object->orient.col(t) = LogSO3(truth[t].orientation.toRotationMatrix());
    }
    holding.assign(static_cast<std::size_t>(frames), kHoldsRight);
  }
  FitResult Fit(const FitOptions& options) const {
    const HandModel* const hands[] = {&scene.hand};
    return FitClip(clip, hands, object, holding, options);
  }

  HandScene scene;
  TriangleMesh mesh;
  SignedDistance surface;
  FitObject object;
  Clip clip;
  std::vector<ObjectPose> truth;
  std::vector<std::uint8_t> holding;
};

// The terms that a rigid carry leaves at zero.
FitOptions PaperAndAcceleration() {
  FitOptions options = FitOptions{}.OnlyPaper();
  options.precision = PairPrecision::kDouble;
  options.lambda_acceleration = 2000.0;
  options.whole_clip = true;
  return options;
}

double SumOfEnergies(const FitResult& result) {
  double sum = 0.0;
  for (const FrameReport& frame : result.frames) sum += frame.energy_total;
  return sum;
}

TEST(SolveClip, ARigidCarryIsTheTruth) {
  const Carried carried(24);
  const FitResult result = carried.Fit(PaperAndAcceleration());
  for (int t = 0; t < 24; ++t) {
    const ObjectTrack& track = *result.clip.object;
    EXPECT_LT((track.trans.col(t) - carried.truth[t].translation).norm(), 1e-4) << t;
    EXPECT_LT(
        AngleBetween(ExpSO3(track.orient.col(t)), carried.truth[t].orientation.toRotationMatrix()),
        1e-3)
        << t;
  }
}

TEST(SolveClip, IsNoWorseThanFrameAfterFrame) {
  const Carried carried(20, true);
  FitOptions options = PaperAndAcceleration();
  options.lambda_acceleration = 0.0;  // what both of them minimize
  options.lambda_temporal = 50.0;     // and heavy enough to matter
  options.whole_clip = false;
  const double sequential = SumOfEnergies(carried.Fit(options));
  options.whole_clip = true;
  const FitResult batch = carried.Fit(options);
  EXPECT_LT(SumOfEnergies(batch), sequential * (1.0 - 1e-4));
  EXPECT_EQ(batch.frames[5].stop, StopReason::kConverged);
}

TEST(SolveClip, ReportsTheCostOfItsReportedEnergies) {
  const Carried carried(10, true);
  FitOptions options = PaperAndAcceleration();
  options.lambda_acceleration = 0.0;
  const HandModel* const hands[] = {&carried.scene.hand};
  std::vector<FittedFrame> fitted(10);
  ClipProblem problem{carried.clip, hands, carried.object, {}, {}, false};
  HandState state(carried.scene.hand);
  state.SetBody(carried.clip.pose[0], carried.clip.trans.col(0));
  const FingerPose fingers = FingersOf(carried.clip.pose[0], Side::kRight);
  state.Evaluate(fingers, false);
  problem.holds.push_back(
      {0, 0, 10,
       InObjectFrame(state.Vertices(), carried.truth[0].orientation, carried.truth[0].translation),
       false});
  for (int t = 0; t < 10; ++t) {
    fitted[t].object = carried.truth[t];
    fitted[t].hands[0].fingers = fingers;
  }
  const ClipReport report = SolveClip(problem, options, 1, fitted);
  double sum = 0.0;
  for (int t = 0; t < 10; ++t) {
    sum += report.frames[t][EnergyTerm::kDistance] +
           options.lambda_contact * report.frames[t][EnergyTerm::kContact];
    if (t == 0) continue;
    sum += options.lambda_temporal *
           Temporal::Energy(fitted[t - 1].object.orientation, fitted[t - 1].object.translation,
                            fitted[t - 1].hands[0].fingers, fitted[t].object.orientation,
                            fitted[t].object.translation, fitted[t].hands[0].fingers);
  }
  EXPECT_NEAR(report.cost_after, 0.5 * sum, 1e-8 * sum);
  EXPECT_LT(report.cost_after, report.cost_before);
}

TEST(SolveClip, DoesNotDependOnThreads) {
  const Carried carried(30, true);
  FitOptions options;
  options.whole_clip = true;
  std::vector<FitResult> results;
  for (const int threads : {1, 2, 3}) {
    options.threads = threads;
    results.push_back(carried.Fit(options));
  }
  for (const std::size_t k : {1u, 2u}) {
    EXPECT_EQ(results[0].clip.object->trans, results[k].clip.object->trans);
    EXPECT_EQ(results[0].clip.object->orient, results[k].clip.object->orient);
    for (int t = 0; t < 30; ++t) EXPECT_EQ(results[0].clip.pose[t], results[k].clip.pose[t]);
  }
}

TEST(SolveClip, LeavesLessAccelerationInTheHand) {
  const Carried carried(24, true);
  FitOptions options = PaperAndAcceleration();
  const HandModel& hand = carried.scene.hand;
  const auto bend = [&](const FitResult& result) {
    HandState state(hand);
    std::vector<Vector3d> in_wrist;
    for (int t = 0; t < 24; ++t) {
      state.SetBody(result.clip.pose[t], result.clip.trans.col(t));
      in_wrist.push_back(state.WristRotation().transpose() *
                         (result.clip.object->trans.col(t) - state.WristPosition()));
    }
    double sum = 0.0;
    for (int t = 1; t + 1 < 24; ++t) {
      sum += (in_wrist[t + 1] - 2.0 * in_wrist[t] + in_wrist[t - 1]).norm();
    }
    return sum;
  };
  options.lambda_acceleration = 1e6;
  const double smooth = bend(carried.Fit(options));
  options.whole_clip = false;
  EXPECT_LT(smooth, 0.5 * bend(carried.Fit(options)));
}

TEST(Slip, AnObjectTurnsInTheFingersAndTheySlideOnIt) {
  // The ball is turned by 40 degrees about its own axis in the hand.
  Carried carried(21);
  constexpr double kTurn = 40.0 * std::numbers::pi / 180.0;
  for (int t = 0; t < 21; ++t) {
    carried.clip.object->orient.col(t) =
        LogSO3(carried.truth[t].orientation.toRotationMatrix() * ExpSO3({0, 0, kTurn * t / 20.0}));
  }
  // Where the hand is on the ball in one frame.
  const auto z_at = [&](const Clip& clip, int t) {
    HandState state(carried.scene.hand);
    state.SetBody(clip.pose[t], clip.trans.col(t));
    state.Evaluate(FingersOf(clip.pose[t], Side::kRight), false);
    return InObjectFrame(state.Vertices(), Quaterniond(ExpSO3(clip.object->orient.col(t))),
                         clip.object->trans.col(t));
  };
  const auto distances = [&](const Eigen::Matrix3Xd& z) {
    Eigen::VectorXd d(z.cols());
    for (Eigen::Index i = 0; i < z.cols(); ++i) d(i) = carried.object.distance->Distance(z.col(i));
    return d;
  };
  FitOptions options;
  options.slip = true;
  options.lambda_object = 1e4;
  options.lambda_penetration = options.lambda_object_in_hand = 0.0;  // the scene begins with some
  for (const bool whole_clip : {false, true}) {
    options.whole_clip = whole_clip;
    const FitResult result = carried.Fit(options);
    const Eigen::Matrix3Xd first = z_at(result.clip, 0), last = z_at(result.clip, 20);
    const Eigen::VectorXd d_first = distances(first), d_last = distances(last);
    const double limit = std::max(0.0, d_first.minCoeff()) + options.slip_touch_m;
    int touching = 0;
    double travel = 0.0, off = 0.0;
    for (Eigen::Index i = 0; i < first.cols(); ++i) {
      if (d_first(i) >= limit) continue;
      ++touching;
      travel += (last.col(i) - first.col(i)).norm();
      off = std::max(off, std::abs(d_last(i) - d_first(i)));
    }
    ASSERT_GT(touching, 10);
    EXPECT_LT(off, 0.001) << whole_clip;                // stays on the surface
    EXPECT_GT(travel / touching, 0.010) << whole_clip;  // and is somewhere else on it
    // The object did turn.
    EXPECT_LT(AngleBetween(ExpSO3(result.clip.object->orient.col(20)),
                           ExpSO3(carried.clip.object->orient.col(20))),
              0.05)
        << whole_clip;
    EXPECT_GT(result.frames[20].energies[EnergyTerm::kSlip], 0.0);
    EXPECT_EQ(result.frames[20].energies[EnergyTerm::kDistance], 0.0);
  }
}

TEST(RobustMean, IgnoresOutliers) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const auto draw = [&](double size) {
    return Vector3d(size * Vector3d(normal(random), normal(random), normal(random)));
  };
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.linear() = ExpSO3({1.0, -2.0, 0.5});
  truth.translation() = Vector3d(0.1, 0.2, 0.3);
  std::vector<Eigen::Isometry3d> poses;
  for (int k = 0; k < 100; ++k) {
    Eigen::Isometry3d pose = truth;
    pose.linear() = truth.linear() * ExpSO3(draw(0.05));
    pose.translation() += draw(0.005);
    if (k % 10 == 0) pose.translation().x() += 0.2;
    poses.push_back(pose);
  }
  const Eigen::Isometry3d mean = RobustMean(poses);
  EXPECT_LT((mean.translation() - truth.translation()).norm(), 0.002);
  EXPECT_LT(AngleBetween(mean.linear(), truth.linear()), 0.02);
}

TEST(RefineClip, TakesNoiseOutOfWhatIsCarried) {
  Carried carried(60, true);
  // The object is fixed to the wrist: the truth here.
  HandState state(carried.scene.hand);
  std::vector<Eigen::Isometry3d> truth;
  Eigen::Isometry3d relation = Eigen::Isometry3d::Identity();
  for (int t = 0; t < 60; ++t) {
    state.SetBody(carried.clip.pose[t], carried.clip.trans.col(t));
    Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();
    wrist.linear() = state.WristRotation();
    wrist.translation() = state.WristPosition();
    if (t == 0) relation = wrist.inverse() * carried.scene.object_pose.Transform();
    truth.push_back(wrist * relation);
  }
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (int t = 0; t < 60; ++t) {
    const auto draw = [&](double size) {
      return Vector3d(size * Vector3d(normal(random), normal(random), normal(random)));
    };
    carried.clip.object->trans.col(t) = truth[t].translation() + draw(0.005);
    carried.clip.object->orient.col(t) = LogSO3(truth[t].linear() * ExpSO3(draw(0.05)));
  }
  FitOptions options = RefinementDefaults();
  options.lambda_penetration = options.lambda_object_in_hand = 0.0;  // the scene has some
  const HandModel* const hands[] = {&carried.scene.hand};
  const RefineResult result =
      RefineClip(carried.clip, hands, carried.object, carried.holding, options);
  ASSERT_EQ(result.holds.size(), 1u);
  EXPECT_TRUE(result.holds[0].rigid);
  EXPECT_NEAR(result.holds[0].noise_mm, 5.0, 1.0);
  double before = 0.0, after = 0.0;
  for (int t = 0; t < 60; ++t) {
    before += (carried.clip.object->trans.col(t) - truth[t].translation()).squaredNorm();
    after += (result.clip.object->trans.col(t) - truth[t].translation()).squaredNorm();
  }
  EXPECT_LT(after, before / 9.0);
}

// A hand comes, presses a centimeter into an object that rests, and goes.
TEST(RefineClip, LeavesWhatIsOnlyTouchedWhereItIs) {
  constexpr int kFrames = 60;
  Carried carried(kFrames);
  const HandModel& hand = carried.scene.hand;
  const Eigen::Isometry3d object = carried.scene.object_pose.Transform();
  HandState state(hand);
  const auto depth = [&](const Clip& clip, int t) {
    state.SetBody(clip.pose[t], clip.trans.col(t));
    state.Evaluate(FingersOf(clip.pose[t], Side::kRight), false);
    double deepest = 0.0;
    for (Eigen::Index i = 0; i < state.Vertices().cols(); ++i) {
      const Vector3d x = object.inverse() * Vector3d(state.Vertices().col(i));
      deepest = std::max(deepest, -carried.object.distance->Distance(x));
    }
    return deepest;
  };
  JointPose flat = carried.scene.pose;
  flat.middleCols<kJointsPerHand>(kRightHandBegin).setZero();
  state.SetBody(flat, carried.scene.trans);
  const Vector3d away = state.WristRotation().col(1);  // the back of the hand's side
  Clip clip = carried.clip;
  for (int t = 0; t < kFrames; ++t) {
    clip.pose[t] = flat;
    const double s = std::cos(2.0 * std::numbers::pi * t / kFrames);  // 1 far, -1 near
    clip.trans.col(t) = carried.scene.trans + (0.11 + 0.05 * s) * away;
    clip.object->trans.col(t) = object.translation();
    clip.object->orient.col(t) = LogSO3(object.linear());
  }
  for (int k = 0; k < 100 && depth(clip, kFrames / 2) < 0.008; ++k) {
    clip.trans.colwise() -= 0.001 * away;
  }
  ASSERT_EQ(depth(clip, 0), 0.0);
  ASSERT_NEAR(depth(clip, kFrames / 2), 0.0085, 0.0006);
  const HandModel* const hands[] = {&hand};
  for (const bool held : {false, true}) {  // as FindHolds may take it
    std::vector<std::uint8_t> holding(kFrames, 0);
    for (int t = 20; held && t < 40; ++t) holding[t] = kHoldsRight;
    const RefineResult result =
        RefineClip(clip, hands, carried.object, holding, RefinementDefaults());
    EXPECT_TRUE(result.holds.empty());
    ASSERT_EQ(result.touches.size(), 1u);
    EXPECT_LT(result.touches[0].begin, kFrames / 2);
    EXPECT_GT(result.touches[0].end, kFrames / 2);
    EXPECT_EQ(result.clip.holding_hand[kFrames / 2], kHoldsRight);
    EXPECT_EQ(result.clip.holding_hand[0], 0);
    for (int t = 0; t < kFrames; ++t) {
      EXPECT_LT((result.clip.object->trans.col(t) - object.translation()).norm(), 1e-4) << t;
      EXPECT_LT(depth(result.clip, t), 0.002) << t;
      EXPECT_LT((result.clip.trans.col(t) - clip.trans.col(t)).norm(), 1e-9) << "the arm gives way";
    }
    EXPECT_EQ(result.clip.pose[0], clip.pose[0]);
  }
}

}  // namespace
}  // namespace holdfast
