// SPDX-License-Identifier: MIT
#include "geometry/body/own_body.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "geometry/body/body_model.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {
namespace {

struct Person {
  Person() : surface(BodyModel::Default()) {
    JointPose pose = JointPose::Zero();
    pose.col(kRightShoulder) << 0.0, 0.0, 1.2;
    pose.col(kLeftShoulder) << 0.0, 0.0, -1.2;
    pose.col(kLeftHip) << -0.6, 0.0, 0.0;
    Forward(surface, pose, Eigen::Vector3d(0.1, -0.2, 0.9), state);
  }
  OwnBody::Posed Near(const OwnBody& body, double margin_m = 0.1) const {
    return {body, state.vertices, state.vertices.rowwise().minCoeff(),
            state.vertices.rowwise().maxCoeff(), margin_m};
  }

  BodySurface surface;
  BodyState state;
};

// Against the whole skin's signed distance, at points of which no arm is near.
TEST(OwnBody, DepthIsTheSignedDistanceToTheSkin) {
  const Person person;
  const OwnBody body(person.surface, 0);
  const OwnBody::Posed skin = person.Near(body);
  const SignedDistance whole({person.state.vertices, person.surface.Faces()});
  const Eigen::Vector3d pelvis = person.state.joints.col(kPelvis);
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(-0.22, 0.22);
  int inside = 0, outside = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d point =
        pelvis + Eigen::Vector3d(uniform(engine), uniform(engine), uniform(engine));
    const SignedDistance::Result exact = whole.Query(point);
    const auto touch = skin.Query(point);
    if (std::abs(exact.distance) > 0.1) {
      EXPECT_FALSE(touch) << i;
      continue;
    }
    ASSERT_TRUE(touch) << i;
    EXPECT_NEAR(touch->depth, -exact.distance, 1e-9) << i;
    EXPECT_LT((touch->surface - exact.closest).norm(), 1e-7) << i;
    EXPECT_NEAR(touch->normal.norm(), 1.0, 1e-12);
    EXPECT_GE(touch->normal.dot(exact.gradient), 0.0) << i;
    ++(touch->depth > 0.0 ? inside : outside);
  }
  EXPECT_GT(inside, 30);
  EXPECT_GT(outside, 30);
}

// Only the skin near the box is looked at, and what it says there is the same.
TEST(OwnBody, ABoxGivesTheSameAnswersWithinIt) {
  const Person person;
  const OwnBody body(person.surface, 1);
  const OwnBody::Posed everywhere = person.Near(body, 0.05);
  const Eigen::Vector3d center = person.state.joints.col(kRightHip);
  const Eigen::Vector3d low = center.array() - 0.1, high = center.array() + 0.1;
  const OwnBody::Posed near(body, person.state.vertices, low, high, 0.05);
  std::mt19937 engine(4);
  std::uniform_real_distribution<double> uniform(-0.1, 0.1);
  int found = 0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d point =
        center + Eigen::Vector3d(uniform(engine), uniform(engine), uniform(engine));
    const auto a = everywhere.Query(point), b = near.Query(point);
    ASSERT_EQ(a.has_value(), b.has_value()) << i;
    if (!a) continue;
    EXPECT_EQ(a->depth, b->depth);
    EXPECT_EQ(a->normal, b->normal);
    ++found;
  }
  EXPECT_GT(found, 50);
}

TEST(OwnBody, ArmsThatAreLeftOutAreNoObstacle) {
  const Person person;
  const Eigen::Vector3d right = person.state.joints.col(kRightWrist),
                        left = person.state.joints.col(kLeftWrist);
  for (std::uint8_t left_out = 0; left_out < 4; ++left_out) {
    const OwnBody body(person.surface, left_out);
    const OwnBody::Posed skin = person.Near(body, 0.05);
    const auto in = [&](const Eigen::Vector3d& point) {
      const auto touch = skin.Query(point);
      return touch && touch->depth > 0.0;
    };
    EXPECT_EQ(in(right), (left_out & 1) == 0) << int(left_out);
    EXPECT_EQ(in(left), (left_out & 2) == 0) << int(left_out);
    EXPECT_TRUE(in(person.state.joints.col(kRightKnee)));
  }
}

// Where the arm was, the skin is open: a point that is nearest to the rim is neither in nor out.
TEST(OwnBody, TheRimOfAnArmThatIsLeftOutSaysNothing) {
  const Person person;
  const OwnBody body(person.surface, 1);
  const OwnBody::Posed skin = person.Near(body, 0.3);
  const Eigen::Vector3d shoulder = person.state.joints.col(kRightShoulder),
                        elbow = person.state.joints.col(kRightElbow);
  EXPECT_FALSE(skin.Query(shoulder + 0.25 * (elbow - shoulder)));
}

TEST(OwnBody, NobodyWithoutSkin) {
  const Person person;
  const OwnBody body(person.surface, 0);
  const OwnBody::Posed skin(body, person.state.vertices, Eigen::Vector3d::Constant(5.0),
                            Eigen::Vector3d::Constant(5.1));
  EXPECT_FALSE(skin.Query(Eigen::Vector3d::Constant(5.05)));
}

TEST(OwnBody, ForearmAndHandAreBeyondTheElbow) {
  const Person person;
  const Eigen::Matrix3Xd& rest = person.surface.RestVertices();
  const Eigen::Matrix3Xd& joints = person.surface.RestJoints();
  const std::vector<int> right = OwnBody::ForearmAndHand(person.surface, Side::kRight);
  const std::vector<int> left = OwnBody::ForearmAndHand(person.surface, Side::kLeft);
  EXPECT_GT(right.size(), 300u);
  EXPECT_NEAR(static_cast<double>(right.size()), static_cast<double>(left.size()),
              0.05 * static_cast<double>(right.size()));
  for (const int i : right) {
    EXPECT_LT(rest(0, i), joints(0, kRightElbow));
    EXPECT_GE((rest.col(i) - joints.col(kRightElbow)).norm(), 0.08);
  }
  for (const int i : person.surface.Model().HandVertexIds(Side::kRight)) {
    EXPECT_TRUE(std::ranges::binary_search(right, i)) << i;
  }
}

}  // namespace
}  // namespace holdfast
