// SPDX-License-Identifier: MIT
#include "solver/handover/passage_clearance.h"

#include <array>

#include <gtest/gtest.h>

#include "geometry/import/load_clip.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kLever = 0.1;

Isometry3d Apply(const Isometry3d& wrist, const WristOffset& offset) {
  return wrist * RigidTransform(offset.rotation.toRotationMatrix(), offset.translation);
}

double Cost(const Isometry3d& a, const Isometry3d& b) {
  return (kLever * LogSO3(b.linear() * a.linear().transpose())).squaredNorm() +
         (b.translation() - a.translation()).squaredNorm();
}

struct Wrists {
  Isometry3d giver = RigidTransform(ExpSO3(Vector3d(0.3, -0.2, 1.0)), {-0.1, -0.3, 1.1});
  Isometry3d receiver = RigidTransform(ExpSO3(Vector3d(-0.4, 0.1, -0.9)), {0.12, -0.28, 1.12});
  Isometry3d wanted = giver.inverse() * receiver *
                      RigidTransform(ExpSO3(Vector3d(0.4, 0.5, -0.3)), {0.03, -0.02, 0.01});
};

TEST(SplitCorrection, LeavesHandsThatFitWhereTheyAre) {
  const Wrists at;
  const auto [giver, receiver] =
      SplitCorrection(at.giver, at.receiver, at.giver.inverse() * at.receiver);
  EXPECT_LT(giver.translation.norm() + receiver.translation.norm(), 1e-9);
  EXPECT_LT(giver.rotation.vec().norm() + receiver.rotation.vec().norm(), 1e-9);
}

TEST(SplitCorrection, BringsHandsTogetherByTheLeastAndBothByAsMuch) {
  const Wrists at;
  const auto [of_giver, of_receiver] = SplitCorrection(at.giver, at.receiver, at.wanted);
  const Isometry3d giver = Apply(at.giver, of_giver), receiver = Apply(at.receiver, of_receiver);
  EXPECT_TRUE((giver.inverse() * receiver).isApprox(at.wanted, 1e-9));
  EXPECT_NEAR((giver.translation() - at.giver.translation()).norm(),
              (receiver.translation() - at.receiver.translation()).norm(), 1e-9);
  const double least = Cost(at.giver, giver) + Cost(at.receiver, receiver);
  for (int k = 0; k < 12; ++k) {  // no other place of both costs less
    const Vector3d step = (k % 2 == 0 ? 1e-3 : -1e-3) * Vector3d::Unit(k / 2 % 3);
    const Isometry3d other =
        k < 6 ? RigidTransform(ExpSO3(step) * giver.linear(), giver.translation())
              : RigidTransform(giver.linear(), giver.translation() + step);
    EXPECT_GT(Cost(at.giver, other) + Cost(at.receiver, other * at.wanted), least) << k;
  }
}

// The demo, whose hands are to be 3 cm and 20 degrees from where they meet.
struct Meeting {
  LoadedClip motion = LoadClip("demo_pass");
  HandModel right{motion.body.model, motion.body.betas, Side::kRight};
  HandModel left{motion.body.model, motion.body.betas, Side::kLeft};
  HandSwitch change;
  Handover handover;
  Clip met = motion.clip;

  Meeting() {
    change.frame = 58;
    change.both_begin = 48;
    change.both_end = 68;
    handover.frame = 48;
    handover.to = Side::kLeft;
    handover.giver_from_receiver =
        Wrist(right, motion.clip, 48).inverse() * Wrist(left, motion.clip, 48) *
        RigidTransform(ExpSO3(Vector3d(0.0, 0.35, 0.0)), {0.0, 0.03, 0.0});
  }
  static Isometry3d Wrist(const HandModel& hand, const Clip& clip, int t) {
    return WristIn(hand, clip.pose[t], clip.trans.col(t));
  }
  void Run() { LetHandsMeet(right, left, std::array{change}, std::array{handover}, met); }
};

TEST(LetHandsMeet, MovesBothArmsSmoothlyAndNoFrameFarAway) {
  Meeting meeting;
  meeting.Run();
  const Clip& before = meeting.motion.clip;
  const Isometry3d apart = Meeting::Wrist(meeting.right, meeting.met, 48).inverse() *
                           Meeting::Wrist(meeting.left, meeting.met, 48);
  EXPECT_TRUE(apart.isApprox(meeting.handover.giver_from_receiver, 1e-6));
  for (int t = 0; t < before.NumFrames(); ++t) {
    if (t > 18 && t < 97) continue;
    EXPECT_EQ(meeting.met.pose[t], before.pose[t]) << t;
  }
  for (const HandModel* hand : {&meeting.right, &meeting.left}) {
    const WristChange all = LargestChange(*hand, before, meeting.met, 0, before.NumFrames());
    const WristChange held = LargestChange(*hand, before, meeting.met, 48, 68);
    EXPECT_NEAR(all.moved_m, held.moved_m, 1e-6);  // most where they meet
    EXPECT_LT(held.moved_m, 0.05);
    EXPECT_LT(held.turned_rad, 0.35);
    EXPECT_GT(held.moved_m + held.turned_rad, 0.02);
    for (int t = 1; t < before.NumFrames(); ++t) {
      const auto shift = [&](int u) {
        return Vector3d(Meeting::Wrist(*hand, meeting.met, u).translation() -
                        Meeting::Wrist(*hand, before, u).translation());
      };
      EXPECT_LT((shift(t) - shift(t - 1)).norm(), 0.005) << t;
    }
  }
}

TEST(LetHandsMeet, LeavesTheClipWithoutTimeToCome) {
  Meeting meeting;
  meeting.change.both_begin = meeting.handover.frame = 5;
  meeting.Run();
  EXPECT_EQ(meeting.met.pose, meeting.motion.clip.pose);
}

}  // namespace
}  // namespace holdfast
