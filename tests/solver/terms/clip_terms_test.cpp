// SPDX-License-Identifier: MIT
// Terms of the whole clip: slip, data, support, and movement between frames.
#include <cmath>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "solver/fit/hand_object_block.h"
#include "solver/terms/hand/object_motion.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/terms/hand/vertex_goals.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::JacobianError;
using testing::ResidualsAt;

Quaterniond Turned(const Vector3d& w) { return Quaterniond(ExpSO3(w)); }

Carrier CarrierAt(const Vector3d& turn, const Vector3d& at) {
  Carrier carrier = Carrier::Identity();
  carrier.linear() = ExpSO3(turn);
  carrier.translation() = at;
  return carrier;
}

// A pose in a frame: what Ceres points at.
struct Pose {
  Quaterniond q;
  Vector3d T;
};

const RotationManifold kManifold;

TEST(ObjectData, IsTheDistanceAndTheTurnAtTenCentimeters) {
  const ObjectPose given{Turned({0.2, 0.3, -0.4}), {1, 2, 3}};
  const ObjectData term(given, 4.0);
  const Quaterniond q = given.orientation * Turned({0, 0.5, 0});
  const Vector3d T(1.0, 2.03, 3.04);
  const Eigen::VectorXd r = ResidualsAt(term, {q.coeffs().data(), T.data()});
  EXPECT_NEAR(r.squaredNorm(), 4.0 * (0.05 * 0.05 + 0.05 * 0.05), 1e-12);
}

TEST(ObjectData, JacobianMatchesDifferences) {
  for (const double angle : {0.0, 1e-8, 0.7, 2.5}) {
    const ObjectData term({Turned({0.3, -0.7, 0.2}), {0.1, 0.2, 0.3}}, 5.0);
    Quaterniond q = Turned({0.3, -0.7, 0.2}) * Turned(angle * Vector3d(0.6, 0.0, 0.8));
    Vector3d T(0.4, -0.5, 0.6);
    EXPECT_LT(JacobianError(term, {q.coeffs().data(), T.data()}, {&kManifold}), 1e-6);
  }
}

TEST(ObjectData, IsOfWhatIsFixedToTheObject) {
  const ObjectPose given{Turned({0.3, -0.7, 0.2}), {0.1, 0.2, 0.3}};
  const ObjectPose fixed{Turned({-0.4, 0.9, 0.1}), {0.05, -0.1, 0.2}};
  const ObjectData term(given, 5.0, fixed);
  ObjectPose at(given.Transform() * fixed.Transform().inverse());
  const Eigen::VectorXd r =
      ResidualsAt(term, {at.orientation.coeffs().data(), at.translation.data()});
  EXPECT_LT(r.norm(), 1e-12);
  at = {at.orientation * Turned({0.5, -0.2, 1.1}), at.translation + Vector3d(0.1, 0.0, -0.3)};
  EXPECT_LT(
      JacobianError(term, {at.orientation.coeffs().data(), at.translation.data()}, {&kManifold}),
      1e-6);
}

TEST(ObjectData, OfAPointIsTheWayFromWhereItIsSeen) {
  const Quaterniond none = Quaterniond::Identity();
  const Vector3d point(0.1, -0.2, 0.05);
  Quaterniond q = Turned({0.5, -0.2, 1.1});
  Vector3d T(0.4, -0.5, 0.6);
  const Vector3d seen = q * point + T - Vector3d(0.01, 0.0, -0.02);
  const ObjectData term({none, seen}, 4.0, {none, point}, 0.0);
  const Eigen::VectorXd r = ResidualsAt(term, {q.coeffs().data(), T.data()});
  EXPECT_LT((r.head<3>() - Vector3d(0.02, 0.0, -0.04)).norm(), 1e-12);
  EXPECT_EQ(r.tail<3>().norm(), 0.0);
  EXPECT_LT(JacobianError(term, {q.coeffs().data(), T.data()}, {&kManifold}), 1e-6);
}

TEST(Support, PushesUpWhatIsBelowAndNothingElse) {
  Eigen::Matrix3Xd corners(3, 3);
  corners << 0.1, -0.1, 0.0, 0.0, 0.05, 0.1, -0.02, 0.03, 0.2;
  const Support term(corners, 0.5, 9.0);
  Quaterniond q = Quaterniond::Identity();
  Vector3d T(3, 4, 0.49);
  const Eigen::VectorXd r = ResidualsAt(term, {q.coeffs().data(), T.data()});
  EXPECT_NEAR(r(0), 3.0 * 0.03, 1e-12);
  EXPECT_EQ(r(1), 0.0);
  EXPECT_EQ(r(2), 0.0);
  q = Turned({0.4, -0.3, 0.2});
  T.z() = 0.45;
  EXPECT_LT(JacobianError(term, {q.coeffs().data(), T.data()}, {&kManifold}), 1e-6);
}

std::vector<double*> Pointers(std::vector<Pose>& poses) {
  std::vector<double*> pointers;
  for (Pose& pose : poses) {
    pointers.push_back(pose.q.coeffs().data());
    pointers.push_back(pose.T.data());
  }
  return pointers;
}

TEST(ObjectMotion, JacobiansMatchDifferences) {
  const Carrier a = CarrierAt({0.3, 0.2, -0.5}, {1, 0, 2});
  const Carrier b = CarrierAt({0.5, -0.1, -0.4}, {1.1, 0.1, 2});
  const Carrier c = CarrierAt({0.9, -0.3, 0.1}, {1.1, 0.3, 2.2});
  std::vector<Pose> poses = {{Turned({0.1, 0.2, 0.3}), {1.1, 0.1, 1.9}},
                             {Turned({0.6, 0.1, 0.2}), {1.2, 0.1, 2.1}}};
  EXPECT_LT(JacobianError(ObjectVelocity(a, b, 0.1, 3.0), Pointers(poses),
                          {&kManifold, nullptr, &kManifold}),
            1e-6);
  poses.push_back({Turned({0.9, 0.5, -0.3}), {1.0, 0.4, 2.0}});
  EXPECT_LT(JacobianError(ObjectAcceleration(a, b, c, 0.1, 3.0), Pointers(poses),
                          {&kManifold, nullptr, &kManifold, nullptr, &kManifold}),
            1e-6);
}

TEST(ObjectMotion, WhatIsCarriedRigidlyDoesNotMove) {
  const Carrier carriers[] = {CarrierAt({0.3, 0.2, -0.5}, {1, 0, 2}),
                              CarrierAt({1.5, -0.1, -0.4}, {1.1, 0.1, 2}),
                              CarrierAt({2.9, -0.3, 0.1}, {1.1, 0.3, 2.2})};
  const Carrier held = CarrierAt({0.4, -0.8, 1.2}, {0.05, 0.02, -0.1});
  std::vector<Pose> poses;
  for (const Carrier& carrier : carriers) {
    const Carrier pose = carrier * held;
    poses.push_back({Quaterniond(pose.linear()), pose.translation()});
  }
  const std::vector<double*> at = Pointers(poses);
  const ObjectVelocity velocity(carriers[0], carriers[1], 1.0, 1.0);
  const ObjectAcceleration acceleration(carriers[0], carriers[1], carriers[2], 1.0, 1.0);
  EXPECT_LT(ResidualsAt(velocity, at.data()).norm(), 1e-12);
  EXPECT_LT(ResidualsAt(acceleration, at.data()).norm(), 1e-12);
}

TEST(ObjectMotion, AConstantTurnHasNoAcceleration) {
  const Vector3d turn(0.1, -0.3, 0.2), way(0.1, 0.2, 0.3);
  const Carrier world = Carrier::Identity();
  std::vector<Pose> poses;
  for (int t = 0; t < 3; ++t) poses.push_back({Turned({1, 2, 0}) * Turned(t * turn), t * way});
  const std::vector<double*> at = Pointers(poses);
  EXPECT_LT(ResidualsAt(ObjectAcceleration(world, world, world, 1.0, 1.0), at.data()).norm(),
            1e-12);
  const Eigen::VectorXd r = ResidualsAt(ObjectVelocity(world, world, 1.0, 1.0), at.data());
  EXPECT_NEAR(r.head<3>().norm(), way.norm(), 1e-12);
  EXPECT_NEAR(r.tail<3>().norm(), turn.norm(), 1e-12);
}

TEST(FingerDifference, JacobianMatchesDifferencesAndSlopesHaveNoBend) {
  FingerPose a = FingerPose::LinSpaced(-0.5, 0.5), b = FingerPose::LinSpaced(0.0, 0.4);
  FingerPose c = 2.0 * b - a;
  const FingerDifference bend({1.0, -2.0, 1.0}, 0.1, 7.0);
  EXPECT_LT(JacobianError(bend, {a.data(), b.data(), c.data()}), 1e-6);
  EXPECT_LT(ResidualsAt(bend, {a.data(), b.data(), c.data()}).norm(), 1e-14);
  const FingerDifference slope({-1.0, 1.0}, 1.0, 4.0);
  EXPECT_LT((ResidualsAt(slope, {a.data(), b.data()}) - 2.0 * (b - a)).norm(), 1e-14);
}

class SlipOnABall : public ::testing::Test {
 protected:
  // A ball, and points just outside of it all around.
  SlipOnABall()
      : ball(ReadMesh(HOLDFAST_MESHES_DIR "/objects/sphere.ply")),
        center(0.5 * (ball.vertices.rowwise().minCoeff() + ball.vertices.rowwise().maxCoeff())),
        surface(Centered(ball, center)),
        grid(surface, {.cell_m = 0.002}),
        radius((ball.vertices.colwise() - center).colwise().norm().maxCoeff()),
        z(3, 12) {
    for (int k = 0; k < 12; ++k) {
      const Vector3d direction(std::cos(0.5 * k), std::sin(0.5 * k), 0.3 * std::sin(1.3 * k));
      z.col(k) = (radius + (k < 8 ? 0.0005 * k : 0.02)) * direction.normalized();
    }
  }
  struct Sum {
    double energy, cost = 0.0;
    Eigen::Matrix3Xd gradient;
  };
  Sum Add(const Slip& slip, const Eigen::Matrix3Xd& at) const {
    std::vector<VertexQuadratic> quadratics(
        static_cast<std::size_t>(at.cols()),
        {Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero(), 0.0});
    Sum sum{slip.Add(at, quadratics), 0.0, Eigen::Matrix3Xd(3, at.cols())};
    for (Eigen::Index i = 0; i < at.cols(); ++i) {
      sum.cost += quadratics[i].cost;
      sum.gradient.col(i) = quadratics[i].gradient;
    }
    return sum;
  }

  static TriangleMesh Centered(TriangleMesh mesh, const Vector3d& center) {
    mesh.vertices.colwise() -= center;
    return mesh;
  }

  TriangleMesh ball;
  Vector3d center;
  SignedDistance surface;
  DistanceGrid grid;
  double radius;
  Eigen::Matrix3Xd z;
};

TEST_F(SlipOnABall, WhatTouchedCountsAndNothingElse) {
  const Slip slip(grid, z, 0.006, 10.0, 0.01);
  EXPECT_EQ(slip.NumContacts(), 8);
  EXPECT_EQ(Add(slip, z).energy, 0.0);
}

TEST_F(SlipOnABall, TravelAlongTheSurfaceIsCheapAndOffItIsNot) {
  const Slip free(grid, z, 0.006, 10.0, 0.0), dragged(grid, z, 0.006, 10.0, 0.01);
  const Eigen::Matrix3Xd turned = ExpSO3(Vector3d(0, 0, 0.2)) * z;
  EXPECT_LT(Add(free, turned).energy, 8 * 1e-3 * 1e-3 * 0.05);  // what facets and grid leave
  const double dragging = Add(dragged, turned).energy;
  EXPECT_GT(dragging, 20.0 * Add(free, turned).energy);
  const Eigen::Matrix3Xd off = 1.2 * z;  // as far as the others travel
  EXPECT_GT(Add(free, off).energy, 10.0 * dragging);
  EXPECT_NEAR(Add(free, off).cost, 0.5 * 10.0 * Add(free, off).energy, 1e-12);
}

TEST_F(SlipOnABall, GradientMatchesDifferences) {
  const Slip slip(grid, z, 0.006, 10.0, 0.3);
  Eigen::Matrix3Xd at = ExpSO3(Vector3d(0.1, 0, 0.2)) * (1.01 * z);
  const Eigen::Matrix3Xd gradient = Add(slip, at).gradient;
  for (Eigen::Index i = 0; i < at.cols(); ++i) {
    for (int k = 0; k < 3; ++k) {
      constexpr double kStep = 1e-6;
      const double x = at(k, i);
      at(k, i) = x + kStep;
      const double above = Add(slip, at).cost;
      at(k, i) = x - kStep;
      const double below = Add(slip, at).cost;
      at(k, i) = x;
      EXPECT_NEAR(gradient(k, i), (above - below) / (2.0 * kStep), 1e-5 * gradient.norm());
    }
  }
}

TEST_F(SlipOnABall, DragIsTowardsTheLastFrame) {
  Slip slip(grid, z, 0.006, 10.0, 0.3);
  const Eigen::Matrix3Xd turned = ExpSO3(Vector3d(0, 0, 0.2)) * z;
  const double before = Add(slip, turned).energy;
  slip.MoveTo(turned);
  EXPECT_LT(Add(slip, turned).energy, 0.05 * before);
  EXPECT_GT(Add(slip, z).energy, 0.5 * before);
}

}  // namespace
}  // namespace holdfast
