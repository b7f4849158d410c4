// SPDX-License-Identifier: MIT
#include "solver/synthesis/standing_life.h"

#include <gtest/gtest.h>

#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// The right hand goes out with an object and stays there for two seconds, all else a statue.
Clip HoldsOut(const BodyMeasures& body) {
  ReachKey start, out;
  start.wrist = {-0.25, -0.25, 1.0};
  out.time_s = 1.0;
  out.wrist = {-0.15, -0.45, 1.2};
  Clip clip = MakeReachMotion(body, {start, out}, {.duration_s = 3.0, .liveliness = 0.0});
  const std::vector<BodyFrame> frames = BodyFrames(clip, body.rest_joints);
  clip.object.emplace();
  clip.object->trans = clip.object->orient = Eigen::Matrix3Xd::Zero(3, clip.NumFrames());
  clip.holding_hand.assign(frames.size(), kHoldsRight);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    clip.object->SetPose(static_cast<Eigen::Index>(t),
                         Place(body.rest_joints, frames[t]).WorldFromJoint(kRightWrist));
  }
  return clip;
}

TEST(StandingLife, WhoHasArrivedLooksAboutOnFeetThatStay) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  Clip clip = HoldsOut(body), other = clip;
  const BodyPlacement first = Place(body.rest_joints, BodyFrames(clip, body.rest_joints).front());
  AddSecondaryMotion(body.rest_joints, "pass", 1, clip);
  AddSecondaryMotion(body.rest_joints, "pass", 2, other);
  const std::vector<BodyFrame> frames = BodyFrames(clip, body.rest_joints);
  double turned = 0.0, apart = 0.0;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const BodyPlacement placed = Place(body.rest_joints, frames[t]);
    EXPECT_LT((placed.joints.col(7) - first.joints.col(7)).norm(), 1e-3) << t;
    EXPECT_LT((placed.WorldFromJoint(kRightWrist).matrix() -
               clip.object->Pose(static_cast<Eigen::Index>(t)).matrix())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-6)
        << t;
    if (t > 45) {
      turned = std::max(turned, AngleBetween(placed.rotation[kHead],
                                             Place(body.rest_joints, frames[45]).rotation[kHead]));
      apart = std::max(apart, (clip.pose[t] - other.pose[t]).cwiseAbs().maxCoeff());
    }
  }
  EXPECT_GT(turned, 3.0 * kDegree);
  EXPECT_GT(apart, 2.0 * kDegree) << "another seed is another person";
}

TEST(StandingLife, WeightFreeArmAndFaceMoveOnFeetThatStayAndThePutDownObjectStays) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  Clip clip = HoldsOut(body);
  const int put_down = clip.NumFrames() - 20;
  std::fill(clip.holding_hand.begin() + put_down, clip.holding_hand.end(), 0);
  const Clip before = clip;
  AddStandingMotion(body.rest_joints, "pass", true, false, 1, clip);
  const auto placed = [&](const Clip& of) {
    return Place(body.rest_joints, BodyFrames(of, body.rest_joints));
  };
  const std::vector<BodyPlacement> was = placed(before), is = placed(clip);
  double weight = 0.0, free = 0.0, face = 0.0;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    EXPECT_LT((is[t].joints.col(7) - was[t].joints.col(7)).norm(), 1e-3) << t;
    weight = std::max(weight, (is[t].joints - was[t].joints).col(kPelvis).norm());
    free = std::max(free, (is[t].joints - was[t].joints).col(kLeftWrist).norm());
    face = std::max(face, AngleBetween(is[t].rotation[kHead], was[t].rotation[kHead]));
    const Eigen::Isometry3d wrist =
        t < put_down ? is[t].WorldFromJoint(kRightWrist) : before.object->Pose(t);
    EXPECT_LT((wrist.matrix() - clip.object->Pose(t).matrix()).cwiseAbs().maxCoeff(), 1e-6) << t;
  }
  EXPECT_LT((is[0].joints - was[0].joints).norm(), 1e-4);
  EXPECT_LT((is[put_down].joints - was[put_down].joints).col(kPelvis).norm(), 1e-3);
  EXPECT_GT(weight, 0.01);
  EXPECT_LT(weight, 0.06);
  EXPECT_GT(free, 0.03);
  EXPECT_GT(face, 8.0 * kDegree);
}

TEST(StandingLife, SwayBeginsWithNothingAndIsSmall) {
  const std::vector<BodyFrame> still(150);
  std::vector<BodyFrame> frames = still;
  AddSway(30.0, 1, frames);
  EXPECT_LT(frames[0].pelvis.norm(), 1e-12);
  EXPECT_GT(std::abs(frames[0].local[kHead].w()), 1.0 - 1e-12);
  double most = 0.0, moved = 0.0;
  for (const BodyFrame& frame : frames) {
    most = std::max(most, AngleBetween(frame.local[kHead].toRotationMatrix(),
                                       still[0].local[kHead].toRotationMatrix()));
    moved = std::max(moved, frame.pelvis.norm());
  }
  EXPECT_GT(most, 0.5 * kDegree);
  EXPECT_LT(most, 12.0 * kDegree);
  EXPECT_GT(moved, 1e-3);
  EXPECT_LT(moved, 0.02);
}

}  // namespace
}  // namespace holdfast
