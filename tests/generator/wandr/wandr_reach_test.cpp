// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "generator/wandr/reach_goals.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/reach_protocol.h"
#include "generator/wandr/walk_pace.h"
#include "geometry/error.h"
#include "tests/support/wandr_scene.h"

namespace holdfast::wandr {
namespace {

using testing::DefaultBody;
using testing::DefaultBones;

// Twenty-two joints that stay where they are; foot joints on the floor at heights that make joint
// 10 the lowest.
Eigen::MatrixXf StillTrack(int frames) {
  Eigen::MatrixXf joints(kJointNumbers, frames);
  for (int f = 0; f < frames; ++f) {
    for (int k = 0; k < kNumBodyJoints; ++k) {
      joints.block<3, 1>(3 * k, f) = Eigen::Vector3f(0.1f * static_cast<float>(k), 0.0f, 1.0f);
    }
    joints(3 * 7 + 2, f) = 0.08f;
    joints(3 * 8 + 2, f) = 0.09f;
    joints(3 * 10 + 2, f) = 0.02f;
    joints(3 * 11 + 2, f) = 0.03f;
  }
  return joints;
}

void Move(Eigen::MatrixXf& joints, int joint, int frame, const Eigen::Vector3f& by) {
  joints.block<3, 1>(3 * joint, frame) += by;
}

TEST(ReachOutcome, ABodyThatStandsStill) {
  const ReachOutcome outcome = MeasureReach(StillTrack(10), {2.1, 0.0, 1.0});  // the wrist at 2.1
  EXPECT_NEAR(outcome.closest_m, 0.0, 1e-6);
  EXPECT_EQ(outcome.closest_frame, 0);
  EXPECT_EQ(outcome.reached_frame, 0);
  EXPECT_EQ(outcome.skating_share, 0.0);
  EXPECT_EQ(outcome.airborne_share, 0.0);
  EXPECT_EQ(outcome.peak_pelvis_m_s, 0.0);
  EXPECT_EQ(outcome.mean_acceleration_m_s2, 0.0);
}

TEST(ReachOutcome, DistancesAndTheFrameOfArrival) {
  Eigen::MatrixXf joints = StillTrack(4);
  // The wrist is 50, 9, 5 and 20 cm away.
  const std::array<float, 4> away = {0.5f, 0.09f, 0.05f, 0.2f};
  for (int f = 0; f < 4; ++f) joints(3 * 21 + 1, f) = away[f];
  const ReachOutcome outcome = MeasureReach(joints, {2.1, 0.0, 1.0});
  EXPECT_NEAR(outcome.closest_m, 0.05, 1e-6);
  EXPECT_EQ(outcome.closest_frame, 2);
  EXPECT_EQ(outcome.reached_frame, 1);
  EXPECT_NEAR(outcome.last_m, 0.2, 1e-6);
  // The left wrist is joint 20 and was never near.
  const ReachOutcome left = MeasureReach(joints, {2.1, 0.0, 2.0}, Side::kLeft);
  EXPECT_FALSE(left.Reached());
}

TEST(ReachOutcome, OnlyTheLowestFootJointSkates) {
  const Eigen::Vector3d goal(0.0, 0.0, 1.0);
  Eigen::MatrixXf joints = StillTrack(5);
  Move(joints, 11, 2, {0.5f, 0.0f, 0.0f});  // not the lowest
  EXPECT_EQ(MeasureReach(joints, goal).skating_share, 0.0);
  Move(joints, 10, 2, {0.0066f, 0.0f, 0.0f});  // there and back, below the limit
  EXPECT_EQ(MeasureReach(joints, goal).skating_share, 0.0);
  Move(joints, 10, 2, {0.0002f, 0.0f, 0.0f});  // above it now
  EXPECT_EQ(MeasureReach(joints, goal).skating_share, 2.0 / 4.0);
  // Upwards is no skating; after it another joint is the lowest.
  joints = StillTrack(5);
  Move(joints, 10, 4, {0.0f, 0.0f, 0.005f});
  EXPECT_EQ(MeasureReach(joints, goal).skating_share, 0.0);
}

TEST(ReachOutcome, FlightSpeedAndAcceleration) {
  Eigen::MatrixXf joints = StillTrack(4);
  for (const int k : {7, 8, 10, 11}) Move(joints, k, 3, {0.0f, 0.0f, 0.11f});
  Move(joints, 0, 1, {0.0f, 0.0f, 0.1f});
  const ReachOutcome outcome = MeasureReach(joints, {0.0, 0.0, 1.0});
  EXPECT_EQ(outcome.airborne_share, 1.0 / 4.0);
  EXPECT_NEAR(outcome.peak_pelvis_m_s, 3.0, 1e-4);
  // Frame 1: the pelvis 2 x 0.1; frame 2: the pelvis 0.1 and four joints 0.11.
  EXPECT_NEAR(outcome.mean_acceleration_m_s2, 900.0 * (0.2 + 0.1 + 4 * 0.11) / (22.0 * 2.0), 1e-3);
}

TEST(ReachOutcome, WhatIsNoNumberAnyMoreDidNotReach) {
  Eigen::MatrixXf joints = StillTrack(6);
  joints(5, 3) = NAN;
  const ReachOutcome outcome = MeasureReach(joints, {2.1, 0.0, 1.0});
  EXPECT_TRUE(outcome.diverged);
  EXPECT_TRUE(outcome.Reached());  // before
  joints(5, 0) = NAN;
  EXPECT_THROW(MeasureReach(joints, {2.1, 0.0, 1.0}), Error);
  EXPECT_THROW(MeasureReach(StillTrack(2), {NAN, 0.0, 1.0}), Error);
}

TEST(ReachOutcome, Summary) {
  std::vector<ReachOutcome> outcomes(4);
  const std::array<double, 4> closest = {0.05, 0.2, 0.6, 0.35};
  for (int i = 0; i < 4; ++i) {
    outcomes[i].closest_m = closest[i];
    outcomes[i].skating_share = 0.1 * i;
  }
  outcomes[0].reached_frame = 7;
  const ReachSummary summary = Summarize(outcomes);
  EXPECT_EQ(summary.success, 0.25);
  EXPECT_NEAR(summary.distance_mean_m, 0.3, 1e-12);
  EXPECT_NEAR(summary.distance_median_m, 0.275, 1e-12);
  EXPECT_NEAR(summary.skating, 0.15, 1e-12);
  EXPECT_THROW(Summarize({}), Error);
}

// A start that faces `turn` counter-clockwise of -y, away from the origin.
RolloutStart<float> TurnedStart(double turn) {
  RolloutStart<double> start;
  start.pose =
      Moved(StandingPose(DefaultBody()), turn, {1.0, 2.0, 0.0}, DefaultBody().rest_joints.col(0));
  return start.Cast<float>();
}

TEST(ReachProtocol, GoalsAreAboutTheStartAsThePaperHasThem) {
  const BoneOffsets<float> bones = DefaultBones().Cast<float>();
  const std::vector starts = {TurnedStart(0.0), TurnedStart(0.9)};
  const std::vector<ReachCase> cases = ReachCases({}, bones, starts);
  ASSERT_EQ(cases.size(), 1250u);
  // The first: straight ahead (-y), floor, half a meter.
  EXPECT_TRUE(cases[0].goal.isApprox(Eigen::Vector3d(1.0, 1.5, 0.0), 1e-5)) << cases[0].goal;
  EXPECT_EQ(cases[0].deadline, 58);  // 42 + 30 * 0.5 / 0.95
  EXPECT_EQ(cases[20].deadline, 200);
  std::set<std::array<long, 3>> places;
  for (const ReachCase& c : cases) {
    const Eigen::Vector2d away = c.goal.head<2>() - Eigen::Vector2d(1.0, 2.0);
    EXPECT_NEAR(away.norm(), 0.5 + 1.125 * c.distance, 1e-5);
    EXPECT_NEAR(c.goal.z(), 0.45 * c.height, 1e-9);
    const double facing = -M_PI / 2.0 + (c.start == 0 ? 0.0 : 0.9);
    const double angle = std::atan2(away.y(), away.x()) - facing - 2.0 * M_PI * c.angle / 5.0;
    EXPECT_NEAR(std::remainder(angle, 2.0 * M_PI), 0.0, 1e-5);
    places.insert({std::lround(1e4 * c.goal.x()), std::lround(1e4 * c.goal.y()),
                   std::lround(1e4 * c.goal.z())});
  }
  EXPECT_EQ(places.size(), 250u);  // five samples each
}

class ReachRuns : public ::testing::Test {
 protected:
  ReachRuns() {
    protocol_.num_angles = 2;
    protocol_.num_heights = 2;
    protocol_.num_distances = 3;
    protocol_.num_samples = 2;
    protocol_.num_frames = 20;
  }
  std::vector<ReachOutcome> Run(int threads) const {
    return RunReachProtocol(network_, bones_, starts_, protocol_, threads);
  }

  Network<float> network_{testing::SmallNetwork(IntentionLayout::kFlagged, 3)};
  BoneOffsets<float> bones_ = DefaultBones().Cast<float>();
  std::vector<RolloutStart<float>> starts_ =
      AsFloat(ComposedStarts(DefaultBody(), Normalizer<double>(testing::WalkingStatistics())));
  ReachProtocol protocol_;
};

TEST_F(ReachRuns, ThreadsDoNotMatter) {
  const std::vector<ReachOutcome> one = Run(1), three = Run(3);
  ASSERT_EQ(one.size(), 144u);
  for (int i = 0; i < 144; ++i) {
    EXPECT_EQ(one[i].closest_m, three[i].closest_m) << i;
    EXPECT_EQ(one[i].mean_acceleration_m_s2, three[i].mean_acceleration_m_s2) << i;
  }
}

// The body's surface by plain skinning.
class OnTheBody : public ::testing::Test {
 protected:
  const Eigen::Matrix3Xd& Skinned(const Pose<double>& pose) {
    JointPose axis_angles = JointPose::Zero();
    for (int k = 0; k < kNumBodyJoints; ++k) axis_angles.col(k) = LogSO3(pose.rotation[k]);
    Forward(surface_, axis_angles, pose.translation, state_);
    return state_.vertices;
  }

  BodySurface surface_{BodyModel::Default()};
  BodyState state_;
  LowestPoint lowest_{surface_};
  LowestPoint::Placed placed_;
};

TEST_F(OnTheBody, TheLowestVertexIsThatOfPlainSkinning) {
  nn::RandomStream random(5);
  std::set<int> found_vertices;
  for (int k = 0; k < 60; ++k) {
    // Standing and stepping, then bent, then upside down and lying.
    Pose<double> pose = testing::RandomPose(random, k < 20 ? 0.2 : k < 40 ? 0.6 : 1.2);
    if (k >= 40) pose.rotation[0] = ExpSO3({3.0 * random.Uniform(), 0.5, 0.0}) * pose.rotation[0];
    const Eigen::Matrix3Xd& vertices = Skinned(pose);
    lowest_.Place(pose, placed_);
    int expected = 0;
    vertices.row(2).minCoeff(&expected);
    const int found = lowest_.Find(placed_, static_cast<int>(random.Next() % 10'000));
    EXPECT_NEAR(vertices(2, found), vertices(2, expected), 1e-12) << k;
    EXPECT_LT((lowest_.Vertex(placed_, found) - vertices.col(found)).norm(), 1e-9);
    found_vertices.insert(found);
  }
  EXPECT_GT(found_vertices.size(), 30u);
}

TEST_F(OnTheBody, SkatingIsThatOfPlainSkinning) {
  const RolloutTrack track = [] {
    const Network<float> network(testing::SmallNetwork(IntentionLayout::kFlagged, 8));
    const Normalizer<double> normalizer(testing::WalkingStatistics());
    const RolloutStart<float> start =
        StartAtRest(StandingPose(DefaultBody()), normalizer).Cast<float>();
    const GoalPlan plan{{{1.0, -1.0, 1.0}, 60}};
    const RolloutRequest request{.starts = {&start, 1}, .plans = {&plan, 1}, .num_steps = 60};
    return RunRollouts(network, DefaultBones().Cast<float>(), request, 1)[0];
  }();
  int skating = 0, lowest = -1;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int f = 0; f <= 60; ++f) {
    const Eigen::Matrix3Xd& vertices = Skinned(PoseOf<float>(track.states.col(f)).Cast<double>());
    if (f > 0 && (vertices.col(lowest) - before).head<2>().norm() > 0.02 / 3.0) ++skating;
    vertices.row(2).minCoeff(&lowest);
    before = vertices.col(lowest);
  }
  EXPECT_GT(skating, 0);
  EXPECT_LT(skating, 60);
  EXPECT_DOUBLE_EQ(SkatingOfLowestVertex(lowest_, track.states), skating / 60.0);
  EXPECT_EQ(SkatingOfLowestVertex(lowest_, track.states.leftCols(1)), 0.0);
}

// A network that answers the intention: random weights do, in some way.
class SeveralGoals : public ::testing::Test {
 protected:
  std::vector<ReachSample> Run(std::span<const Eigen::Vector3d> goals, int count,
                               int threads = 1) const {
    return ReachGoals(network_, DefaultBones().Cast<float>(), start_, goals, count, threads,
                      options_);
  }

  Network<float> network_{testing::SmallNetwork(IntentionLayout::kFlagged, 3)};
  RolloutStart<float> start_ =
      StartAtRest(StandingPose(DefaultBody()), Normalizer<double>(testing::WalkingStatistics()))
          .Cast<float>();
  ReachGoalsOptions options_{.frames = 30, .seed = 7};
};

// Due after 30 frames: given up after 45 when the wrist comes no closer, and after 60 in any case.
TEST_F(SeveralGoals, AreGivenUpSomeTimeAfterTheyWereDue) {
  const std::vector<Eigen::Vector3d> goals = {{4.0, -30.0, 1.0}, {-4.0, 30.0, 1.0}};
  const std::vector<ReachSample> samples = Run(goals, 3, 2);
  for (const ReachSample& sample : samples) {
    EXPECT_EQ(sample.NumReached(), 0);
    int first = 0;
    for (std::size_t g = 0; g < goals.size(); ++g) {
      const GoalOutcome& goal = sample.goals[g];
      EXPECT_EQ(goal.taken_on, first);
      EXPECT_EQ(goal.due, first + 30);
      double closest = INFINITY;
      for (int f = first; f <= goal.left; ++f) {
        const double distance =
            (sample.track.joints.block<3, 1>(63, f).cast<double>() - goals[g]).norm();
        const bool closer = distance < closest;
        closest = std::min(closest, distance);
        const bool given_up = f >= first + 60 || (f >= first + 45 && !closer);
        EXPECT_EQ(given_up, f == goal.left) << g << ' ' << f;
      }
      first = goal.left;
      EXPECT_EQ(sample.goal_of_frame[static_cast<std::size_t>(first - 1)], static_cast<int>(g));
    }
    EXPECT_EQ(sample.track.states.cols(), first + 1);
    EXPECT_EQ(sample.goal_of_frame.size(), static_cast<std::size_t>(first) + 1);
  }
  EXPECT_NE(samples[0].track.states, samples[1].track.states);
  const std::vector<ReachSample> alone = Run(goals, 1);
  EXPECT_EQ(alone[0].track.states, samples[0].track.states);
}

TEST_F(SeveralGoals, OneAloneIsTheRolloutOfItsPlan) {
  const std::vector<Eigen::Vector3d> goals = {{0.5, -1.0, 1.0}};
  const ReachSample sample = Run(goals, 1)[0];
  const GoalPlan plan{{goals[0], 30}};
  const RolloutRequest request{
      .starts = {&start_, 1}, .plans = {&plan, 1}, .num_steps = 30, .seed = 7};
  const RolloutTrack track = RunRollouts(network_, DefaultBones().Cast<float>(), request, 1)[0];
  // The same but for the least time left, which the last frames come to.
  EXPECT_EQ(sample.track.states.leftCols(20), track.states.leftCols(20));
}

TEST_F(SeveralGoals, TheNextIsTakenOnWhenOneIsReached) {
  // A place that the wrist passes: where it is in frame 12 of the motion to the second goal.
  const std::vector<Eigen::Vector3d> far = {{0.5, -1.0, 1.0}};
  const ReachSample direct = Run(far, 1)[0];
  const Eigen::Vector3d start_wrist = direct.track.joints.block<3, 1>(63, 0).cast<double>();
  const std::vector<Eigen::Vector3d> goals = {start_wrist, far[0]};
  const ReachSample sample = Run(goals, 1)[0];
  EXPECT_EQ(sample.goals[0].reached, 0);
  EXPECT_EQ(sample.goals[0].closest_frame, 0);
  EXPECT_EQ(sample.goals[0].left, 1);  // it comes no closer
  EXPECT_EQ(sample.goals[1].taken_on, 1);
  EXPECT_EQ(sample.goals[1].due, 31);
  // A last goal that is reached is kept for the frames that the motion lingers.
  const std::vector<Eigen::Vector3d> near = {start_wrist};
  const ReachSample lingering = Run(near, 1)[0];
  EXPECT_EQ(lingering.track.states.cols(), 1 + 1 + options_.lingering_frames);
  EXPECT_EQ(lingering.goal_of_frame.size(), 17u);
}

// The wrist passes the goal some time after it has come within reach of it.
TEST_F(SeveralGoals, TheLastIsKeptUntilTheWristWasClosest) {
  const ReachSample direct = Run(std::vector<Eigen::Vector3d>{{0.5, -1.0, 1.0}}, 1)[0];
  const std::vector<Eigen::Vector3d> goals = {
      direct.track.joints.block<3, 1>(63, 8).cast<double>()};
  const ReachSample sample = Run(goals, 1)[0];
  const GoalOutcome& goal = sample.goals[0];
  ASSERT_TRUE(goal.Reached());
  ASSERT_GT(goal.closest_frame, 0);
  ASSERT_LT(goal.closest_frame, 60);
  EXPECT_EQ(goal.left - goal.closest_frame, 1 + options_.lingering_frames);
}

TEST_F(SeveralGoals, AreDueWhenOneWouldHaveWalkedThere) {
  const std::vector<Eigen::Vector3d> goals = {{1.0, -2.0, 1.0}};
  const Eigen::Vector3d pelvis =
      start_.pose.translation.cast<double>() + DefaultBones().offset.col(0);
  const int frames = PaceOf(start_, pelvis, StartVelocity(network_, start_), goals[0]).Deadline();
  options_.frames.reset();
  EXPECT_EQ(Run(goals, 1)[0].goals[0].due, frames);
  options_.slack = 1.5;
  EXPECT_EQ(Run(goals, 1)[0].goals[0].due, std::lround(1.5 * frames));
}

TEST_F(SeveralGoals, TheLeftWristReachesAsTheRightOneInTheMirror) {
  // Of a body that is not symmetric.
  BoneOffsets<double> bones = DefaultBones();
  bones.offset.col(20) *= 1.1;
  bones.offset.col(0).x() += 0.02;
  StateMatrix<double> states =
      Run(std::vector<Eigen::Vector3d>{{0.5, -1.0, 1.0}}, 1)[0].track.states.cast<double>();
  const StateMatrix<double> mirrored = MirroredStates(states);
  EXPECT_LT((MirroredStates(mirrored) - states).cwiseAbs().maxCoeff(), 1e-6);
  BodyKinematics<double> here, there;
  for (const int f : {0, 20, 40}) {
    ForwardKinematics(bones, PoseOf<double>(states.col(f)), here);
    ForwardKinematics(MirroredBones(bones), PoseOf<double>(mirrored.col(f)), there);
    for (int k = 0; k < kNumBodyJoints; ++k) {
      EXPECT_LT((MirroredPoint(here.joints.col(k)) - there.joints.col(MirrorJoint(k))).norm(), 1e-6)
          << k;
    }
  }
}

TEST_F(SeveralGoals, RefusesNoneAndWhatIsNoNumber) {
  EXPECT_THROW(Run({}, 1), Error);
  EXPECT_THROW(Run(std::vector<Eigen::Vector3d>{{0.0, NAN, 1.0}}, 1), Error);
  EXPECT_THROW(Run(std::vector<Eigen::Vector3d>{{0.0, 0.0, 1.0}}, 0), Error);
  options_.frames = 0;
  EXPECT_THROW(Run(std::vector<Eigen::Vector3d>{{0.0, 0.0, 1.0}}, 1), Error);
}

TEST(IntentionParts, WhatIsLeftOutIsZeroAndHasNoGradient) {
  nn::RandomStream random(11);
  const auto draw = [&] {
    return Eigen::Vector3d(random.Uniform() - 0.5, random.Uniform() - 0.5, random.Uniform());
  };
  for (const IntentionLayout layout :
       {IntentionLayout::kPaper, IntentionLayout::kFlagged, IntentionLayout::kBounded}) {
    const int size = IntentionSize(layout);
    for (const IntentionParts parts :
         {IntentionParts{true, false, false}, IntentionParts{false, true, false},
          IntentionParts{false, false, true}}) {
      const IntentionBody<double> body{HeadingOf(ExpSO3({0.1, 0.2, 0.9})), draw(), draw()};
      FrameGoal<double> goal{true, 3.0 * draw(), 12.0, parts};
      const Eigen::VectorXd bar =
          Eigen::VectorXd::NullaryExpr(size, [&] { return random.Uniform(); });
      const auto told = [&](const Eigen::Vector3d& by) {
        FrameGoal<double> moved = goal;
        moved.position += by;
        Eigen::VectorXd out(size);
        WriteIntention(layout, body, moved, out.data());
        return out;
      };
      const Eigen::VectorXd out = told(Eigen::Vector3d::Zero());
      const int walk = layout == IntentionLayout::kBounded ? 6 : 3;
      const int turn = layout == IntentionLayout::kBounded ? 8 : 6;
      EXPECT_EQ(out.head(walk).isZero(0.0), !parts.wrist);
      EXPECT_EQ(out.segment<2>(walk).isZero(0.0), !parts.pelvis);
      EXPECT_EQ(out.segment<2>(turn).isZero(0.0), !parts.heading);
      IntentionBar<double> found;
      WriteIntentionVjp(layout, body, goal, bar.data(), found);
      const Eigen::VectorXd expected =
          testing::NumericGradient([&](const Eigen::VectorXd& by) { return bar.dot(told(by)); }, 3);
      EXPECT_LT((found.goal - expected).norm(), 1e-7);
    }
  }
}

TEST(ReachStarts, ComposedOnesStandOnTheFloorAndDiffer) {
  const Normalizer<double> normalizer(testing::WalkingStatistics());
  const std::vector<ReachStart> starts = ComposedStarts(DefaultBody(), normalizer);
  ASSERT_EQ(starts.size(), 6u);
  BodyKinematics<double> kinematics;
  std::vector<Eigen::Vector3d> wrists;
  for (const ReachStart& start : starts) {
    ForwardKinematics(DefaultBones(), start.start.pose, kinematics);
    const auto& joints = kinematics.joints;
    // The balls of the feet as high as in the rest pose, soles on the floor.
    const double rest = DefaultBody().rest_joints(1, 10) - DefaultBody().sole_y;
    EXPECT_NEAR(joints(2, 10), rest, 0.03) << start.name;
    EXPECT_NEAR(joints(2, 11), rest, 0.03) << start.name;
    EXPECT_GT(joints(2, 15), 1.0) << start.name;
    for (const Eigen::Vector3d& other : wrists) {
      EXPECT_GT((joints.col(21) - other).norm(), 0.01) << start.name;
    }
    wrists.push_back(joints.col(21));
  }
}

}  // namespace
}  // namespace holdfast::wandr
