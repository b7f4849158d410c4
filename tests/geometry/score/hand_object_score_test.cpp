// SPDX-License-Identifier: MIT
#include "geometry/score/contact_score.h"

#include <array>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using testing::Box;
using testing::Sphere;

// A person at rest, and an object whose center is in the middle of the right palm, carried along.
struct Scene {
  Scene() : hand(BodyModel::Default(), {}, Side::kRight) {
    const Eigen::Matrix3Xd& joints = hand.Surface().RestJoints();
    palm = 0.5 * (joints.col(WristJoint(Side::kRight)) + joints.col(kRightHandBegin + 3));
    constexpr int kFrames = 6;
    clip.pose.assign(kFrames, JointPose::Zero());
    clip.trans.setZero(3, kFrames);
    clip.object.emplace();
    clip.object->trans.resize(3, kFrames);
    clip.object->orient.resize(3, kFrames);
    // The pelvis turns and moves, and the object with it.
    const Eigen::Vector3d pelvis = joints.col(0);
    for (int t = 0; t < kFrames; ++t) {
      const Eigen::Vector3d turn(0.02 * t * t, 0.1 * t, 0.0);
      clip.pose[t].col(0) = turn;
      clip.trans.col(t) << 0.01 * t * t, 0.0, 0.03 * t;
      clip.object->orient.col(t) = turn;
      clip.object->trans.col(t) = ExpSO3(turn) * (palm - pelvis) + pelvis + clip.trans.col(t);
    }
  }

  HandObjectScore Measure(const TriangleMesh& mesh, int threads = 1) const {
    const Solid object(mesh);
    HandObjectProtocol protocol;
    protocol.contact.threads = threads;
    const ExactIntersection exact(object);
    return MeasureHandObject(clip, hand, object, &exact, protocol);
  }

  HandModel hand;
  Eigen::Vector3d palm;
  Clip clip;
};

// A blade: thin, longer than the palm is thick, with vertices all along.
TriangleMesh Blade() {
  TriangleMesh blade = Sphere(1.0, 4);
  blade.vertices = Eigen::Vector3d(0.0004, 0.06, 0.0004).asDiagonal() * blade.vertices;
  return blade;
}

TEST(HandObjectScore, ABladeThroughThePalmIsSeenByItsOwnVertices) {
  const HandObjectScore score = Scene().Measure(Blade());
  const HandObjectFrame& frame = score.frames[0];
  EXPECT_EQ(frame.hand.max_penetration_mm, 0.0);  // no vertex of the hand is in it
  EXPECT_GT(frame.object_max_penetration_mm, 5.0);
  EXPECT_EQ(frame.DeepestPenetration_mm(), frame.object_max_penetration_mm);
  EXPECT_GT(frame.object_vertices_inside, 10);
  ASSERT_TRUE(frame.exact_volume.Known());
  EXPECT_GT(frame.exact_volume.volume_m3, 0.0);
}

TEST(ContactScore, CountsBothWaysInAllFramesAndContactInThoseHeld) {
  const HandObjectScore blade = Scene().Measure(Blade());
  HandObjectScore scores[] = {blade, blade};
  scores[0].holds = {0, 1, 1, 1, 0, 0};
  scores[1].holds = {0, 0, 0, 1, 0, 0};
  scores[1].frames[3].hand.in_contact = false;
  scores[1].frames[3].hand.contact_ratio = 0.0;
  scores[0].frames[2].hand.in_contact = false;
  scores[1].frames[5].object_max_penetration_mm = 99.0;
  const ContactScore score = ScoreContact(scores);
  ASSERT_EQ(score.frames.size(), 6u);
  EXPECT_EQ(score.penetration_max_mm, 99.0);
  EXPECT_EQ(score.object_in_hand_max_mm, 99.0);
  EXPECT_EQ(score.frames[0].penetration_mm, blade.frames[0].object_max_penetration_mm);
  EXPECT_EQ(score.deep_frames, 6);
  EXPECT_EQ(ScoreContact(scores, 50.0).deep_frames, 1);
  // Of the three frames held a holding hand touches in two; four times a hand holds.
  EXPECT_FALSE(score.frames[0].held);
  EXPECT_DOUBLE_EQ(*score.contact_frames_ratio, 2.0 / 3.0);
  EXPECT_NEAR(*score.contact_ratio, 0.75 * blade.frames[1].hand.contact_ratio, 1e-12);
  scores[0].holds = scores[1].holds = std::vector<std::uint8_t>(6, 0);
  EXPECT_FALSE(ScoreContact(scores).contact_frames_ratio);
  EXPECT_EQ(ScoreContact({}).frames.size(), 0u);
}

TEST(HandObjectScore, ABoxAroundTheHandHoldsAllOfIt) {
  const Scene scene;
  const HandObjectScore score = scene.Measure(Box({-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}));
  const HandObjectFrame& frame = score.frames[0];
  // Depth of the deepest vertex, from the box's faces.
  double deepest = 0.0;
  for (const auto& v : scene.hand.Surface().RestVertices().colwise()) {
    deepest = std::max(deepest, 0.3 - (v - scene.palm).cwiseAbs().maxCoeff());
  }
  EXPECT_NEAR(frame.hand.max_penetration_mm, 1e3 * deepest, 1e-3);
  EXPECT_EQ(frame.hand.penetrating_ratio, 1.0);
  const Solid closed({scene.hand.Surface().RestVertices(), scene.hand.Surface().Faces()}, true);
  EXPECT_NEAR(frame.exact_volume.volume_m3 / SignedVolume(closed.mesh), 1.0, 1e-7);
  EXPECT_NEAR(frame.hand.intersection_volume_cm3 / (1e6 * frame.exact_volume.volume_m3), 1.0, 0.02);
}

TEST(HandObjectScore, SeesWhichFingersTouchAndHowTheThumbBends) {
  Scene scene;
  const Eigen::Matrix3Xd& joints = scene.hand.Surface().RestJoints();
  const int thumb = kRightHandBegin + kJointsPerHand - 3;
  TriangleMesh ball = Sphere(0.008, 2);  // at the thumb's last joint
  ball.vertices.colwise() += joints.col(thumb + 2) - scene.palm;
  // The last joint bends further in frame 1 and the other way in frame 2.
  const Eigen::Vector3d first = joints.col(thumb + 1) - joints.col(thumb);
  const Eigen::Vector3d second = joints.col(thumb + 2) - joints.col(thumb + 1);
  const Eigen::Vector3d axis = first.cross(second).normalized();
  constexpr double kAngle = 40.0 * kDegree;
  scene.clip.pose[1].col(thumb + 2) = kAngle * axis;
  scene.clip.pose[2].col(thumb + 2) = -kAngle * axis;
  const HandObjectScore score = scene.Measure(ball);
  const HandObjectFrame& frame = score.frames[0];
  EXPECT_EQ(frame.finger_touches, (std::array<bool, 5>{false, false, false, false, true}));
  EXPECT_EQ(frame.fingertip_touches, frame.finger_touches);
  EXPECT_GT(score.frames[1].thumb_bend_deg, frame.thumb_bend_deg + 25.0);
  EXPECT_LE(score.frames[1].thumb_bend_deg, frame.thumb_bend_deg + 40.0 + 1e-9);
  EXPECT_NE(score.frames[2].thumb_bend_deg, frame.thumb_bend_deg);

  ball.vertices.colwise() += joints.col(kRightHandBegin) - joints.col(thumb + 2);
  const HandObjectFrame at_index = scene.Measure(ball).frames[0];  // its first joint
  EXPECT_TRUE(at_index.finger_touches[0]);
  EXPECT_FALSE(at_index.fingertip_touches[0]);
  EXPECT_FALSE(at_index.finger_touches[4]);
}

TEST(HandObjectScore, ARigidCarryNeitherSlipsNorShakes) {
  const HandObjectScore score = Scene().Measure(Sphere(0.03, 4));
  EXPECT_EQ(score.track.mean_iou, 1.0);
  // Skinning weights are stored in single precision: they sum to 1 within 1e-8.
  EXPECT_NEAR(*score.track.max_drift, 0.0, 1e-4);
  EXPECT_NEAR(*score.jitter.acceleration_ratio, 1.0, 1e-9);
  EXPECT_NEAR(*score.jitter.angular_acceleration_ratio, 1.0, 1e-9);
  EXPECT_NEAR(score.frames[0].exact_volume.volume_m3, score.frames[5].exact_volume.volume_m3,
              1e-11);
}

TEST(HandObjectScore, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene;
  const HandObjectScore one = scene.Measure(Sphere(0.03, 3), 1);
  const HandObjectScore three = scene.Measure(Sphere(0.03, 3), 3);
  for (std::size_t t = 0; t < one.frames.size(); ++t) {
    EXPECT_EQ(one.frames[t].hand, three.frames[t].hand);
    EXPECT_EQ(one.frames[t].exact_volume.volume_m3, three.frames[t].exact_volume.volume_m3);
  }
}

TEST(HandObjectScore, AClipWithoutAnObjectIsRefused) {
  Scene scene;
  scene.clip.object.reset();
  EXPECT_THROW(scene.Measure(Sphere(0.03, 2)), Error);
}

}  // namespace
}  // namespace holdfast
