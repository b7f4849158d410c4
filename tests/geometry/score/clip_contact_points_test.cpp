// SPDX-License-Identifier: MIT
#include "geometry/score/contact_writer.h"

#include <gtest/gtest.h>

#include "geometry/body/hand_model.h"
#include "geometry/error.h"
#include "geometry/io/container/npz.h"
#include "geometry/score/hand_object_score.h"
#include "tests/support/moving_clip.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

constexpr double kThreshold_m = 0.005;

class ContactPoints : public ::testing::Test {
 protected:
  // A small object that the right index finger's tip is in, turned against the world.
  ContactPoints() : clip_(testing::MakeMovingClip(5, 21)), thing_(MakeThing(0.03)) {
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      BodyState state;
      Forward(surface_, clip_.pose[t], clip_.trans.col(t), state);
      clip_.object->trans.col(t) = state.joints.col(HandBegin(Side::kRight) + 2);
    }
  }

  static TriangleMesh MakeThing(double size_m) {
    TriangleMesh thing = testing::Tetrahedron();
    thing.vertices.colwise() -= thing.vertices.rowwise().mean().eval();
    thing.vertices *= size_m / thing.vertices.colwise().norm().maxCoeff();
    return thing;
  }

  ClipContactPoints Find(int threads = 1) const {
    return FindContactPoints(clip_, body_, {}, SignedDistance(thing_), kThreshold_m, threads);
  }

  std::shared_ptr<const BodyModel> body_ = BodyModel::Default();
  BodySurface surface_{body_};
  Clip clip_;
  TriangleMesh thing_;
};

TEST_F(ContactPoints, AreTheVerticesThatTheMetricsCount) {
  const ClipContactPoints found = Find();
  const HandModel hand(body_, {}, Side::kRight);
  const Solid thing(thing_);
  const auto frames =
      MeasureHandObject(clip_, hand, thing, nullptr, {.contact = {}, .measure_exact = false})
          .frames;
  for (int t = 0; t < clip_.NumFrames(); ++t) {
    double deepest_mm = 0;
    int touching = 0;
    for (const ContactPoint& point : found.points) {
      if (point.frame != t || point.side != Side::kRight) continue;
      deepest_mm = std::max(deepest_mm, 1e3 * point.depth_m);
      touching += std::abs(point.depth_m) < kThreshold_m;
    }
    ASSERT_GT(deepest_mm, 0);
    EXPECT_NEAR(deepest_mm, frames[t].hand.max_penetration_mm, 1e-9);
    EXPECT_NEAR(touching, frames[t].hand.contact_ratio * hand.NumVertices(), 1e-6);
  }
}

TEST_F(ContactPoints, LieDepthAlongTheNormalFromTheirVertexInTheWorldToo) {
  const ClipContactPoints found = Find();
  ASSERT_FALSE(found.points.empty());
  BodyState state;
  int frame = -1;
  for (const ContactPoint& point : found.points) {
    if (point.frame != frame) {
      frame = point.frame;
      Forward(surface_, clip_.pose[frame], clip_.trans.col(frame), state);
    }
    EXPECT_NEAR(point.normal_in_object.norm(), 1, 1e-9);
    const Eigen::Vector3d vertex_in_object =
        point.in_object - point.depth_m * point.normal_in_object;
    EXPECT_LT((found.object[frame] * vertex_in_object - state.vertices.col(point.vertex)).norm(),
              1e-9);
  }
}

TEST_F(ContactPoints, TellTheFinger) {
  int index = 0;
  const ClipContactPoints found = Find();
  for (const ContactPoint& point : found.points) index += kHandParts[point.part] == "index";
  EXPECT_GT(index, 0.5 * static_cast<double>(found.points.size()));
}

TEST_F(ContactPoints, TipsEndTheFingers) {
  const ClipContactPoints found = Find();
  BodyState state;
  Forward(surface_, clip_.pose[3], clip_.trans.col(3), state);
  ASSERT_EQ(found.hands, (std::vector<Side>{Side::kRight, Side::kLeft}));
  constexpr std::array<int, 5> kLastJoint = {14, 2, 5, 11, 8};  // thumb to pinky
  for (int h = 0; h < 2; ++h) {
    const HandPose& hand = found.hand_poses[3][h];
    const Side side = found.hands[h];
    EXPECT_LT((hand.wrist.translation() - state.joints.col(WristJoint(side))).norm(), 1e-12);
    for (int tip = 0; tip < 5; ++tip) {
      const int joint = HandBegin(side) + kLastJoint[tip];
      EXPECT_LT((hand.tips[tip].linear() - state.world_rotation[joint]).norm(), 1e-12);
      const double phalanx_m = (hand.tips[tip].translation() - state.joints.col(joint)).norm();
      EXPECT_GT(phalanx_m, 0.010);
      EXPECT_LT(phalanx_m, 0.045);
      // On the skin, but for the correctives.
      const Eigen::Vector3d at = hand.tips[tip].translation();
      EXPECT_LT((state.vertices.colwise() - at).colwise().norm().minCoeff(), 0.003);
    }
  }
}

TEST_F(ContactPoints, AreTheSameOnAnyNumberOfThreads) {
  const testing::TemporaryFolder folder;
  WriteContactsNpz(Find(1), folder / "one.npz");
  WriteContactsNpz(Find(3), folder / "three.npz");
  EXPECT_EQ(testing::ReadText(folder / "one.npz"), testing::ReadText(folder / "three.npz"));
}

TEST_F(ContactPoints, FileHoldsPointsInBothFrames) {
  const testing::TemporaryFolder folder;
  const ClipContactPoints found = Find();
  WriteContactsNpz(found, folder / "contacts.npz");
  const NpzReader npz(folder / "contacts.npz");
  const auto n = static_cast<std::ptrdiff_t>(found.points.size());
  npz.Read("wrist_pose").RequireShape({5, 2, 4, 4});
  npz.Read("fingertip_pose").RequireShape({5, 2, 5, 4, 4});
  for (const char* key : {"contact_point_object", "contact_point_world", "contact_normal_object",
                          "contact_normal_world"}) {
    npz.Read(key).RequireShape({n, 3});
  }
  const auto frames = npz.Read("contact_frame").AsIntegers();
  const auto poses = npz.Read("object_pose").AsDoubles();
  const auto in_object = npz.Read("contact_point_object").AsDoubles();
  const auto in_world = npz.Read("contact_point_world").AsDoubles();
  const auto normals = npz.Read("contact_normal_object").AsDoubles();
  const auto world_normals = npz.Read("contact_normal_world").AsDoubles();
  using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    const Matrix pose = Eigen::Map<const Matrix>(poses.data() + 16 * frames[k]);
    const auto three = [&](const std::vector<double>& values) {
      return Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(values.data() + 3 * k));
    };
    const Eigen::Vector3d point =
        pose.topLeftCorner<3, 3>() * three(in_object) + pose.topRightCorner<3, 1>();
    EXPECT_LT((point - three(in_world)).norm(), 1e-12);
    EXPECT_LT((pose.topLeftCorner<3, 3>() * three(normals) - three(world_normals)).norm(), 1e-12);
  }
}

TEST_F(ContactPoints, NeedAnObject) {
  clip_.object.reset();
  EXPECT_THROW(Find(), Error);
}

}  // namespace
}  // namespace holdfast
