// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "generator/matching/capture_quality.h"
#include "generator/matching/foot_lock.h"
#include "generator/matching/matched_reaches.h"
#include "generator/matching/motion_player.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/generator/test_body.h"
#include "tests/support/walking_figure.h"

namespace holdfast {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::FigureLibrary;
using testing::StandingFigure;
using testing::WalkingFigure;

constexpr double kRate = MotionLibrary::kFrameRate;

const Eigen::Matrix3Xd& Rest() { return DefaultMeasures().rest_joints; }
SolePoints TheSoles() { return SolePoints(Rest(), DefaultMeasures().sole_y); }

double Distance(const BodyFrame& a, const BodyFrame& b) {
  double worst = (a.pelvis - b.pelvis).norm();
  for (int j = 0; j < kNumBodyJoints; ++j) {
    worst = std::max(worst, a.local[j].angularDistance(b.local[j]));
  }
  return worst;
}

TEST(BodyFrame, IsTheClipItCameFromAndGoesBackToIt) {
  const Clip clip = WalkingFigure(DefaultMeasures(), 40, 1.0);
  const Clip again = ToClip(BodyFrames(clip, Rest()), clip.frame_rate, Rest(), JointPose::Zero());
  EXPECT_LT((again.trans - clip.trans).cwiseAbs().maxCoeff(), 1e-12);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    for (int j = 0; j < kNumBodyJoints; ++j) {
      EXPECT_LT(AngleBetween(ExpSO3(again.pose[t].col(j)), ExpSO3(clip.pose[t].col(j))), 1e-7);
    }
  }
}

TEST(BodyFrame, MirroredPutsEveryJointAtTheMirroredPlace) {
  const BodyFrame frame = BodyFrames(WalkingFigure(DefaultMeasures(), 40, 1.0), Rest())[13];
  const BodyPlacement placed = Place(Rest(), frame), mirrored = Place(Rest(), Mirror(frame));
  for (int j = 0; j < kNumBodyJoints; ++j) {
    Vector3d expected = placed.joints.col(MirrorJoint(j));
    expected.x() = -expected.x();
    EXPECT_LT((mirrored.joints.col(j) - expected).norm(), 2e-3) << j;  // rest joints: nearly even
  }
}

TEST(PlanarMove, AlignsHeadingAndPlaceAndKeepsHeights) {
  const std::vector<BodyFrame> frames =
      BodyFrames(WalkingFigure(DefaultMeasures(), 40, 1.0), Rest());
  const PlanarMove away{2.1, {3.0, -1.0}};
  const BodyFrame moved = away * frames[20];
  const BodyFrame aligned = AlignHeading(moved, frames[5]) * moved;
  EXPECT_NEAR(std::remainder(Yaw(aligned) - Yaw(frames[5]), 2 * M_PI), 0.0, 1e-12);
  EXPECT_LT((aligned.pelvis - frames[5].pelvis).head<2>().norm(), 1e-12);
  EXPECT_DOUBLE_EQ(aligned.pelvis.z(), frames[20].pelvis.z());
}

TEST(MotionBlend, BeginsAtTheOldMotionWithItsVelocityAndEndsAtTheNew) {
  const std::vector<BodyFrame> old_motion =
      BodyFrames(WalkingFigure(DefaultMeasures(), 60, 0.9), Rest());
  const std::vector<BodyFrame> new_motion =
      BodyFrames(WalkingFigure(DefaultMeasures(), 60, 1.1), Rest());
  const PlanarMove move = AlignHeading(new_motion[49], old_motion[18]);
  const MotionBlend blend(old_motion[17], old_motion[18], move * new_motion[48],
                          move * new_motion[49], kRate, 0.3);
  EXPECT_LT(Distance(blend.Apply(move * new_motion[49], 0.0), old_motion[18]), 1e-9);
  EXPECT_LT(Distance(blend.Apply(move * new_motion[58], 0.3), move * new_motion[58]), 1e-12);
  // One frame on, the old motion's next frame is hardly left: position and velocity go on.
  const BodyFrame next = blend.Apply(move * new_motion[50], 1.0 / kRate);
  EXPECT_LT(Distance(next, old_motion[19]), 0.01);
}

TEST(LockFeet, PlantedFeetStandStillWhereMotionDragsThem) {
  const SolePoints soles = TheSoles();
  // A walker whose steps are longer than the way it makes: every planted foot slides.
  Clip clip = WalkingFigure(DefaultMeasures(), 150, 1.0);
  for (int t = 0; t < clip.NumFrames(); ++t) clip.trans(1, t) *= 0.9;
  std::vector<BodyFrame> frames = BodyFrames(clip, Rest());
  const auto points_of = [&] { return soles.At(Place(Rest(), frames)); };
  const std::vector<SoleBits> contacts = FindContacts(points_of(), kRate);
  // Contacts that go on, and the greatest way of such a point from a frame to the next.
  const auto slide = [&] {
    const std::vector<Soles> points = points_of();
    double worst = 0.0;
    for (std::size_t t = 1; t < points.size(); ++t) {
      for (const int ball : {1, 3}) {
        const unsigned both = contacts[t - 1] & contacts[t];
        if ((both >> ball & 1u) == 0) continue;
        worst = std::max(worst, (points[t] - points[t - 1]).col(ball).head<2>().norm());
      }
    }
    return worst;
  };
  const int planted = static_cast<int>(
      std::count_if(contacts.begin(), contacts.end(), [](SoleBits bits) { return bits != 0; }));
  ASSERT_GT(planted, 75);
  ASSERT_GT(slide(), 2e-3);
  FootLockReport report;
  LockFeet(Rest(), soles, contacts, frames, {}, &report);
  EXPECT_LT(slide(), 3e-4);
  EXPECT_LT(report.max_correction_m, 0.1);
  EXPECT_LT(report.max_missed_m, 1e-3);
}

TEST(LockFeet, FirstFrameStaysAndStepsClearTheGround) {
  const SolePoints soles = TheSoles();
  // A walker that shuffles: its feet are never high, and the first frame is in mid-step.
  Clip clip = WalkingFigure(DefaultMeasures(), 150, 1.0);
  for (int t = 0; t < clip.NumFrames(); ++t) clip.trans(1, t) *= 0.9;
  std::vector<BodyFrame> frames = BodyFrames(clip, Rest());
  frames.erase(frames.begin(), frames.begin() + 8);
  const std::vector<BodyFrame> before = frames;
  const std::vector<SoleBits> contacts = FindSupports(soles.At(Place(Rest(), frames)), kRate);
  constexpr double kHigh = 0.08;
  LockFeet(Rest(), soles, contacts, frames, {.clearance_m = kHigh, .keep_first = true});
  EXPECT_LT(Distance(frames[0], before[0]), 1e-6);
  int steps = 0;
  for (const int heel : {0, 2}) {
    const auto carries = [&](std::size_t t) { return (contacts[t] >> heel & 3u) != 0; };
    for (std::size_t begin = 1; begin < frames.size(); ++begin) {
      if (!carries(begin - 1) || carries(begin)) continue;
      std::size_t end = begin;
      while (end < frames.size() && !carries(end)) ++end;
      if (end == frames.size() || end - begin < 7) continue;
      const Soles middle = soles.At(Place(Rest(), frames[(begin + end) / 2]));
      EXPECT_GT(std::min(middle(2, heel), middle(2, heel + 1)), 0.9 * kHigh) << begin;
      ++steps;
    }
  }
  EXPECT_GT(steps, 3);
}

TEST(FindSupports, OneFootCarriesHoweverFastBothSlide) {
  // Feet that shuffle over the ground in turns, the slower one at 0.6 m/s: too fast for a contact.
  std::vector<Soles> soles(90, Soles::Zero());
  for (std::size_t t = 1; t < soles.size(); ++t) {
    const bool left_waits = t / 15 % 2 == 0;
    soles[t] = soles[t - 1];
    soles[t].leftCols<2>().array().row(1) += (left_waits ? 0.6 : 1.8) / 30.0;
    soles[t].rightCols<2>().array().row(1) += (left_waits ? 1.8 : 0.6) / 30.0;
  }
  for (const SoleBits bits : FindContacts(soles, 30.0)) EXPECT_EQ(bits, 0);
  const std::vector<SoleBits> supports = FindSupports(soles, 30.0);
  for (std::size_t t = 0; t < supports.size(); ++t) {
    if (t % 15 < 2 || t % 15 > 12) continue;  // where they change over
    const bool left_waits = t / 15 % 2 == 0;
    EXPECT_EQ((supports[t] & kLeftSole) != 0, left_waits) << t;
    EXPECT_EQ((supports[t] & kRightSole) != 0, !left_waits) << t;
  }
  EXPECT_TRUE(FindSupports({}, 30.0).empty());
}

TEST(FindSupports, AgreesWithContactsWhereFeetStand) {
  const std::vector<Soles> points =
      TheSoles().At(Place(Rest(), BodyFrames(WalkingFigure(DefaultMeasures(), 150, 1.0), Rest())));
  const std::vector<SoleBits> contacts = FindContacts(points, kRate),
                              supports = FindSupports(points, kRate);
  int same = 0;
  for (std::size_t t = 0; t < points.size(); ++t) {
    EXPECT_NE(supports[t], 0) << t;
    same += ((contacts[t] & kLeftSole) != 0) == ((supports[t] & kLeftSole) != 0);
    same += ((contacts[t] & kRightSole) != 0) == ((supports[t] & kRightSole) != 0);
  }
  EXPECT_GT(same, 270) << "of 300";
}

TEST(WalkPlan, EndsAtTheTargetFacingAsAsked) {
  WalkTarget target;
  target.place = Vector2d(2.0, 1.0);
  target.yaw_rad = 1.2;
  WalkState state;
  for (int t = 0; t < 60; ++t) {
    // A walker that does exactly as planned, a third of a second at a time.
    const FuturePath path = PlanWalk(state, target);
    const Vector2d moved = Eigen::Rotation2Dd(state.yaw_rad) * Vector2d(path.col(0));
    state.velocity = 3.0 * moved;
    state.place += moved;
    state.yaw_rad += YawToFace(path.col(3));
  }
  EXPECT_LT((state.place - target.place).norm(), 0.05);
  EXPECT_NEAR(std::remainder(state.yaw_rad - target.yaw_rad, 2 * M_PI), 0.0, 0.05);
}

TEST(MotionLibrary, FindsTheFrameThatItIsAskedFor) {
  const MotionLibrary library = FigureLibrary(DefaultMeasures());
  // A frame's own feature, path included, is nearest to itself.
  const MotionLibrary::Place stand = library.Search(library.Query({0, 30, 0.0f}, PlanStand()));
  EXPECT_EQ(library.Clips()[stand.clip].name, "stand");
}

TEST(MotionPlayer, JumpsWithoutAJumpOfTheBody) {
  const MotionLibrary library = FigureLibrary(DefaultMeasures());
  MotionPlayer player(library, {2, 10, 0.0f}, 1.0);
  for (int t = 0; t < 20; ++t) player.Step();
  player.Jump({2, 70, 0.0f}, 1.1, 0.35);
  for (int t = 0; t < 30; ++t) player.Step();
  double before = 0.0, after = 0.0;
  const std::vector<BodyFrame>& frames = player.Frames();
  for (std::size_t t = 1; t < 20; ++t) {
    before = std::max(before, Distance(frames[t], frames[t - 1]));
  }
  for (std::size_t t = 20; t < frames.size(); ++t) {
    after = std::max(after, Distance(frames[t], frames[t - 1]));
  }
  EXPECT_LT(after, 1.8 * before);
  ASSERT_EQ(player.Segments().size(), 2u);
  EXPECT_EQ(player.Segments()[1].begin, 20);
}

TEST(MotionPlayer, GoesWhereTheFeetThatCarryItLeaveIt) {
  // A walker whose steps are longer than the way it makes: played, it makes the way of its steps.
  const auto played = [](double share) {
    Clip clip = WalkingFigure(DefaultMeasures(), 150, 1.0);
    clip.trans.row(1) *= share;
    MotionLibrary library(Rest(), DefaultMeasures().sole_y);
    library.Add(clip, "walk", {true, {}});
    library.Finish();
    MotionPlayer player(library, {0, 10, 0.0f}, 1.0);
    for (int t = 0; t < 120; ++t) player.Step();
    return (player.Frames().back().pelvis - player.Frames().front().pelvis).norm();
  };
  const double way = played(1.0);
  EXPECT_NEAR(way, 119.0 / kRate, 0.15);
  EXPECT_NEAR(played(0.9), way, 0.06);  // instead of a tenth, 40 cm, less
}

TEST(MatchReaches, IsTheSameForASeedAndAnotherForAnother) {
  const MotionLibrary library = FigureLibrary(DefaultMeasures());
  MatchedReachOptions options;
  options.reaches = 2;
  const MatchedReaches a = MatchReaches(library, options, 5);
  const MatchedReaches b = MatchReaches(library, options, 5);
  const MatchedReaches other = MatchReaches(library, options, 6);
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t t = 0; t < a.frames.size(); ++t) {
    ASSERT_EQ(Distance(a.frames[t], b.frames[t]), 0.0);
  }
  ASSERT_EQ(a.reaches.size(), 2u);
  EXPECT_FALSE(other.reaches[0].goal.isApprox(a.reaches[0].goal, 1e-3));
  for (const ReachEvent& event : a.reaches) {
    const BodyPlacement placed = Place(Rest(), a.frames[static_cast<std::size_t>(event.frame)]);
    // What a warp has to make up for is no more than goals are scattered by.
    EXPECT_LT((placed.joints.col(21) - event.goal).norm(), options.goal_scatter_m + 0.02);
    EXPECT_GT(event.frame, event.begin);
    EXPECT_LT(event.frame, event.end);
  }
}

TEST(MatchReaches, GoalsWithoutWalkingAreInReach) {
  const MotionLibrary library = FigureLibrary(DefaultMeasures());
  MatchedReachOptions options;
  options.without_walking = 1.0;
  options.begin_walking = 0.0;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const MatchedReaches motion = MatchReaches(library, options, seed);
    ASSERT_EQ(static_cast<int>(motion.reaches.size()), options.reaches);
    const Vector3d stands = motion.frames.front().pelvis;
    for (const ReachEvent& event : motion.reaches) {
      EXPECT_LT((event.goal - stands).head<2>().norm(), 1.0) << seed;
    }
  }
}

TEST(MatchReaches, WalkersAreThereSoonerAtAHigherPace) {
  const MotionLibrary library = FigureLibrary(DefaultMeasures());
  const auto frames = [&](double pace) {
    MatchedReachOptions options;
    options.pace = pace;
    options.without_walking = 0.0;
    int sum = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      sum += MatchReaches(library, options, seed).reaches.back().frame;
    }
    return sum;
  };
  EXPECT_LT(frames(1.3), 0.9 * frames(0.6));
}

TEST(MatchReaches, SomeBeginInMidWalkAndSomeStanding) {
  const MotionLibrary library = FigureLibrary(DefaultMeasures());
  const auto first_speed = [&](double begin_walking) {
    MatchedReachOptions options;
    options.begin_walking = begin_walking;
    const MatchedReaches motion = MatchReaches(library, options, 4);
    return kRate * (motion.frames[3].pelvis - motion.frames[0].pelvis).head<2>().norm() / 3.0;
  };
  EXPECT_GT(first_speed(1.0), 0.5);
  EXPECT_LT(first_speed(0.0), 0.3);
}

TEST(MatchReaches, SaysWhenNobodyReaches) {
  MotionLibrary library(Rest(), DefaultMeasures().sole_y);
  library.Add(StandingFigure(DefaultMeasures(), 90), "stand", {true, {}});
  library.Finish();
  EXPECT_THROW(MatchReaches(library, MatchedReachOptions(), 1), Error);
}

TEST(MotionQuality, SeesSlidingFeetAndJumps) {
  const SolePoints soles = TheSoles();
  JointLimits limits;
  limits.fill(3.0);
  std::vector<BodyFrame> frames = BodyFrames(StandingFigure(DefaultMeasures(), 60), Rest());
  const MotionQuality standing = MeasureQuality(Rest(), soles, frames, limits);
  EXPECT_EQ(standing.skate_ratio, 0.0);
  EXPECT_NEAR(standing.lowest_sole_m, 0.0, 0.01);
  EXPECT_TRUE(FaultOf(standing).empty());
  for (std::size_t t = 0; t < frames.size(); ++t) frames[t].pelvis.x() += 0.01 * double(t);
  EXPECT_EQ(MeasureQuality(Rest(), soles, frames, limits).skate_ratio, 1.0);
  frames[30].pelvis.z() += 0.2;
  EXPECT_GT(MeasureQuality(Rest(), soles, frames, limits).max_acceleration, 150.0);
  limits.fill(0.0);
  EXPECT_GT(MeasureQuality(Rest(), soles, frames, limits).beyond_limits_ratio, 0.05);
}

}  // namespace
}  // namespace holdfast
