// SPDX-License-Identifier: MIT
#include "solver/score/standing_score.h"

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "geometry/body/body_model.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

// A person stands for a second; the pelvis moves 3 cm forward and 4 cm to the side meanwhile.
struct Standing {
  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  Clip clip;

  Standing() {
    ReachKey hang;
    hang.wrist = {-0.25, -0.1, 0.9};
    clip = MakeReachMotion(body, {hang}, {.duration_s = 1.0, .liveliness = 0.0});
    const Vector3d first = clip.trans.col(0);
    const int last = clip.NumFrames() - 1;
    for (int t = 0; t <= last; ++t) {
      clip.pose[t] = clip.pose[0];
      clip.trans.col(t) = first + Vector3d(0.04, -0.03, 0.1) * t / last;
    }
  }
  StandingScore Score(const TriangleMesh* object = nullptr) const {
    return MeasureStanding(clip, JointTrajectory(clip, body.rest_joints), body.rest_joints, object);
  }
};

TEST(StandingScore, RangesAndTheSpeedAtTheEnd) {
  const Standing standing;
  const StandingScore score = standing.Score();
  EXPECT_NEAR(score.pelvis_range_m, 0.05, 1e-9) << "the height does not count";
  EXPECT_NEAR(score.free_wrist_range_m, std::sqrt(0.0125), 1e-9);
  EXPECT_NEAR(score.end_speed_m_s,
              std::sqrt(0.0125) * standing.clip.frame_rate / (standing.clip.NumFrames() - 1), 1e-6);
}

TEST(StandingScore, LeanAndFaceInTheFirstFrame) {
  Standing standing;
  const StandingScore before = standing.Score();
  // About the pelvis's x axis: forward.
  Eigen::Ref<Vector3d> spine = standing.clip.pose[0].col(kSpine1);
  spine = LogSO3(Eigen::Matrix3d(ExpSO3(Vector3d(0.2, 0.0, 0.0)) * ExpSO3(Vector3d(spine))));
  const StandingScore after = standing.Score();
  EXPECT_GT(after.head_down_start_rad - before.head_down_start_rad, 0.1);
  EXPECT_LT(after.head_down_start_rad - before.head_down_start_rad, 0.2) << "it is turned aside";
  EXPECT_GT(after.lean_start_rad - before.lean_start_rad, 0.1);
  EXPECT_LT(after.lean_start_rad - before.lean_start_rad, 0.2) << "the pelvis stays";
}

TEST(StandingScore, TheFaceIsTowardsTheObject) {
  Standing standing;
  const TriangleMesh mug = LoadObject("mug").mesh;
  BodyState state;
  ForwardJoints(standing.body.rest_joints, standing.clip.pose[0], standing.clip.trans.col(0),
                state);
  const Eigen::Isometry3d head = state.WorldFromJoint(kHead);
  standing.clip = Slice(standing.clip, 0, 1);
  standing.clip.object.emplace();
  standing.clip.object->trans = standing.clip.object->orient = Eigen::Matrix3Xd::Zero(3, 1);
  const auto at = [&](const Vector3d& in_head) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = head * in_head;
    standing.clip.object->SetPose(0, pose);
    return standing.Score(&mug).gaze_off_rad;
  };
  EXPECT_LT(at({0.0, 0.05, 1.0}).value(), 5.0 * kDegree) << "the mug's center is beside its origin";
  EXPECT_NEAR(at({1.0, 0.05, 0.1}).value(), 90.0 * kDegree, 6.0 * kDegree);
  EXPECT_FALSE(at({0.0, 0.0, 0.2})) << "at the face";
}

TEST(VesselTilt, OfWhatIsOpenOnTop) {
  Standing standing;
  standing.clip.object.emplace();
  standing.clip.object->trans = standing.clip.object->orient =
      Eigen::Matrix3Xd::Zero(3, standing.clip.NumFrames());
  standing.clip.object->orient.col(3) = Vector3d(0.0, 0.5, 0.0);
  const auto tilt = MeasureVesselTilt(standing.clip, LoadObject("mug").mesh);
  ASSERT_TRUE(tilt);
  EXPECT_NEAR(tilt->start_rad, 0.0, 0.05);
  EXPECT_NEAR(tilt->max_rad, 0.5, 0.05);
  EXPECT_FALSE(MeasureVesselTilt(standing.clip, LoadObject("cube").mesh));
}

}  // namespace
}  // namespace holdfast
