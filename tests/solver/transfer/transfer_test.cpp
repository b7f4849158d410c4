// SPDX-License-Identifier: MIT
#include "solver/transfer/transfer.h"

#include <gtest/gtest.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/object/load_object.h"
#include "solver/transfer/variants.h"

namespace holdfast {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

LoadedClip Demo(const char* name = "demo_drink") {
  LoadedClip loaded = LoadClip(name);
  loaded.clip = Slice(loaded.clip, 0, 20);
  return loaded;
}

Matrix3Xd Joints(const Clip& clip, const ClipBody& body, int t) {
  BodyState state;
  ForwardJoints(body.model->RestJoints(body.model->ShapedVertices(body.betas)), clip.pose[t],
                clip.trans.col(t), state);
  return state.joints;
}

TEST(OtherBody, OntoTheSameOneChangesNothing) {
  const LoadedClip demo = Demo();
  const Clip moved = OntoOtherBody(demo.clip, demo.body, demo.body).clip;
  for (int t = 0; t < demo.clip.NumFrames(); ++t) {
    EXPECT_LT((Joints(moved, demo.body, t) - Joints(demo.clip, demo.body, t)).norm(), 1e-3);
  }
}

TEST(OtherBody, LeavesTheFeetWhereTheyWere) {
  const LoadedClip demo = Demo();
  for (const double beta : {-2.0, 2.0}) {
    ClipBody other = demo.body;
    other.betas = Eigen::VectorXd::Constant(1, beta);
    const auto [moved, report] = OntoOtherBody(demo.clip, demo.body, other);
    EXPECT_LT(report.ankle_missed_m, 0.002);
    for (int t = 0; t < demo.clip.NumFrames(); ++t) {
      const Matrix3Xd before = Joints(demo.clip, demo.body, t), after = Joints(moved, other, t);
      for (const int ankle : {kLeftAnkle, kRightAnkle}) {
        EXPECT_LT((after.col(ankle) - before.col(ankle)).head<2>().norm(), 0.003);
        EXPECT_LT(std::abs(after(2, ankle) - before(2, ankle)), 0.03);
      }
    }
  }
}

TEST(BringWrists, PutsTheHandOnItsPathAndLetsItGoSmoothly) {
  const LoadedClip demo = Demo();
  Clip clip = demo.clip;
  WristPath path{Side::kRight, 5, 12, {}};
  for (int t = 5; t < 12; ++t) {
    Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();
    BodyState state;
    ForwardJoints(demo.body.model->RestJoints(demo.body.model->ShapedVertices(demo.body.betas)),
                  demo.clip.pose[t], demo.clip.trans.col(t), state);
    wrist = state.WorldFromJoint(kRightWrist);
    wrist.translation() += Vector3d(0.02, 0.03, 0.04);
    path.wrist.push_back(wrist);
  }
  const ArmReport report = BringWrists(demo.body, {path}, 0.1, clip);
  EXPECT_LT(report.shortfall_m, 1e-6);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const Vector3d off = Joints(clip, demo.body, t).col(kRightWrist) -
                         Joints(demo.clip, demo.body, t).col(kRightWrist);
    if (t >= 5 && t < 12) {
      EXPECT_LT((off - Vector3d(0.02, 0.03, 0.04)).norm(), 1e-6);
    } else if (t == 0 || t == 19) {
      EXPECT_EQ(off.norm(), 0.0);
    }
  }
}

TEST(MirrorClip, TwiceIsTheClipAgain) {
  LoadedClip demo = Demo();
  demo.clip.object.emplace();
  demo.clip.object->trans = Matrix3Xd::Random(3, 20);
  demo.clip.object->orient = Matrix3Xd::Random(3, 20);
  demo.clip.holding_hand.assign(20, kHoldsRight);
  const Matrix3Xd rest = demo.body.model->RestJoints(demo.body.model->ShapedVertices({}));
  const Clip once = MirrorClip(demo.clip, rest.col(0));
  EXPECT_EQ(once.holding_hand.front(), kHoldsLeft);
  const Vector3d wrist = Joints(demo.clip, demo.body, 3).col(kRightWrist);
  EXPECT_LT(
      (Joints(once, demo.body, 3).col(kLeftWrist) - Vector3d(-wrist.x(), wrist.y(), wrist.z()))
          .norm(),
      1e-8);  // the body's arrays are in single precision
  const Clip twice = MirrorClip(once, rest.col(0));
  EXPECT_LT((twice.trans - demo.clip.trans).norm(), 1e-12);
  EXPECT_LT((twice.object->orient - demo.clip.object->orient).norm(), 1e-12);
}

TEST(TransferClip, RefusesAClipThatNobodyHoldsAnythingIn) {
  LoadedClip demo = Demo();
  const PreparedObject cube = PrepareObject(LoadObject("cube"));
  const SurfaceMap map = SurfaceMap::Scaled(cube.object.mesh, Vector3d::Ones());
  EXPECT_THROW(TransferClip(demo.clip, demo.body, cube, demo.body, cube, map), Error);
  demo.clip.object.emplace();
  demo.clip.object->trans = demo.clip.object->orient = Matrix3Xd::Zero(3, 20);
  demo.clip.holding_hand.assign(20, 0);
  EXPECT_THROW(TransferClip(demo.clip, demo.body, cube, demo.body, cube, map), Error);
  demo.clip.holding_hand.assign(20, kHoldsRight);  // a meter away
  EXPECT_THROW(TransferClip(demo.clip, demo.body, cube, demo.body, cube, map), Error);
}

}  // namespace
}  // namespace holdfast
