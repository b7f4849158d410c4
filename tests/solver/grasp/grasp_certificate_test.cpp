// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_certificate.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using Wrench6 = Eigen::Matrix<double, 6, 1>;

constexpr double kRadius = 0.05;

GraspContact OnBall(const Eigen::Vector3d& direction) {
  return {kRadius * direction.normalized(), -direction.normalized()};
}

std::vector<GraspContact> Antipodal() {
  return {OnBall(Eigen::Vector3d::UnitX()), OnBall(-Eigen::Vector3d::UnitX())};
}

// `latitude` below the middle, so that the contacts carry the ball from below.
std::vector<GraspContact> ThreeAround(double latitude) {
  std::vector<GraspContact> contacts;
  for (int k = 0; k < 3; ++k) {
    const double a = 2.0 * std::numbers::pi * k / 3.0;
    contacts.push_back(OnBall(
        {std::cos(latitude) * std::cos(a), std::cos(latitude) * std::sin(a), -std::sin(latitude)}));
  }
  return contacts;
}

std::vector<GraspContact> FaceCenters() {
  std::vector<GraspContact> contacts;
  for (int k = 0; k < 3; ++k) {
    contacts.push_back(OnBall(Eigen::Vector3d::Unit(k)));
    contacts.push_back(OnBall(-Eigen::Vector3d::Unit(k)));
  }
  return contacts;
}

std::vector<GraspContact> Scattered(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<GraspContact> contacts;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d d(normal(random), normal(random), normal(random));
    contacts.push_back(OnBall(d));
    contacts.back().inward =
        (contacts.back().inward + 0.2 * Eigen::Vector3d(normal(random), normal(random), 0.0))
            .normalized();
  }
  return contacts;
}

TEST(GraspCertificate, HardAntipodalPointsHoldTheWeightButDoNotResistTwisting) {
  const GraspCertificate certificate =
      CertifyContacts(Antipodal(), Eigen::Vector3d::Zero(), kRadius);
  EXPECT_EQ(certificate.ball_lower, 0.0);
  EXPECT_LT(certificate.ball_upper, 1e-3);
  ASSERT_TRUE(certificate.least_friction);
  // Squeezed by 100 weights in all, friction 0.01 carries one: a pyramid of 8 edges wants up to
  // 8 % more.
  EXPECT_NEAR(*certificate.least_friction, 0.01, 0.0059);

  // Off the axis the weight twists it.
  const Eigen::Vector3d off(0.0, 0.01, 0.0);
  EXPECT_FALSE(CertifyContacts(Antipodal(), off, kRadius).least_friction);
}

TEST(GraspCertificate, ContactsBelowTheMiddleNeedFrictionByTheirSlope) {
  // Pulled up, each contact can push down by mu cos(l) - sin(l) of its normal force.
  const double latitude = 15.0 * kDegree;
  CertificateOptions options;
  options.cone_edges = 60;
  options.friction_step = 0.002;
  const GraspCertificate certificate =
      CertifyContacts(ThreeAround(latitude), Eigen::Vector3d::Zero(), kRadius, options);
  ASSERT_TRUE(certificate.least_friction);
  const double pulled_up = std::tan(latitude) + 1.0 / (100.0 * std::cos(latitude));
  EXPECT_NEAR(*certificate.least_friction, pulled_up, 0.004);
  EXPECT_TRUE(HoldsGravity(ThreeAround(latitude), Eigen::Vector3d::Zero(), kRadius,
                           pulled_up + 0.004, options));
  EXPECT_FALSE(HoldsGravity(ThreeAround(latitude), Eigen::Vector3d::Zero(), kRadius,
                            std::tan(latitude) - 0.002, options));
}

TEST(GraspCertificate, SixFaceCentersHoldTheWeightWithoutFriction) {
  const GraspCertificate certificate =
      CertifyContacts(FaceCenters(), Eigen::Vector3d::Zero(), kRadius);
  ASSERT_TRUE(certificate.least_friction);
  EXPECT_EQ(*certificate.least_friction, 0.0);
  // The forces' octahedron has radius 1/sqrt(3); moments are less by friction.
  EXPECT_GT(certificate.ball_lower, 0.0);
  EXPECT_LT(certificate.ball_upper, 1.0 / std::sqrt(3.0));
  CertificateOptions smooth;
  smooth.friction = 0.0;
  EXPECT_EQ(CertifyContacts(FaceCenters(), Eigen::Vector3d::Zero(), kRadius, smooth).ball_lower,
            0.0);
}

TEST(GraspCertificate, ContactsOnOneSideHoldNothing) {
  const std::vector<GraspContact> contacts = {OnBall({1, 0.2, 0}), OnBall({1, -0.2, 0}),
                                              OnBall({1, 0, 0.3})};
  const GraspCertificate certificate = CertifyContacts(contacts, Eigen::Vector3d::Zero(), kRadius);
  EXPECT_EQ(certificate.ball_lower, 0.0);
  EXPECT_FALSE(certificate.least_friction && *certificate.least_friction <= 0.5);
  EXPECT_FALSE(CertifyContacts({}, Eigen::Vector3d::Zero(), kRadius).least_friction);
}

// The radius by dense sampling of directions, each walked down: from above.
double SampledRadius(const std::vector<GraspContact>& contacts, double friction) {
  std::vector<Wrench6> wrenches;
  for (const GraspContact& contact : contacts) {
    const Eigen::Vector3d t = contact.inward.unitOrthogonal(), b = contact.inward.cross(t);
    for (int e = 0; e < 8; ++e) {
      const double a = std::numbers::pi * e / 4.0;
      const Eigen::Vector3d f = contact.inward + friction * (std::cos(a) * t + std::sin(a) * b);
      Wrench6 w;
      w << f, (contact.point / kRadius).cross(f);
      wrenches.push_back(w);
    }
  }
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  double least = 1e9;
  for (int start = 0; start < 400; ++start) {
    Wrench6 d;
    for (int k = 0; k < 6; ++k) d(k) = normal(random);
    d.normalize();
    double here = 1e9;
    for (double step = 0.3; step > 1e-4; step *= 0.93) {
      Wrench6 next = d;
      for (int k = 0; k < 6; ++k) next(k) += step * normal(random);
      next.normalize();
      double support = -1e9;
      for (const Wrench6& w : wrenches) support = std::max(support, w.dot(next));
      if (support < here) {
        here = support;
        d = next;
        step = std::min(0.3, step * 1.2);
      }
    }
    least = std::min(least, here);
  }
  return std::max(0.0, least);
}

TEST(GraspCertificate, BoundsOfTheBallEncloseWhatSamplingFinds) {
  int closed = 0;
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    const std::vector<GraspContact> contacts = Scattered(6 + 2 * static_cast<int>(seed), seed);
    const CertificateOptions options;
    const GraspCertificate certificate =
        CertifyContacts(contacts, Eigen::Vector3d::Zero(), kRadius, options);
    const double sampled = SampledRadius(contacts, options.friction);
    EXPECT_LE(certificate.ball_lower, sampled + 1e-9) << seed;
    EXPECT_LE(certificate.ball_upper, sampled + 0.01) << seed;
    EXPECT_GE(certificate.ball_upper, certificate.ball_lower) << seed;
    if (sampled == 0.0) continue;
    ++closed;
    EXPECT_GE(certificate.ball_lower, 0.6 * sampled) << seed;
    // With what pads resist besides, by another search.
    EXPECT_GE(WrenchQuality(contacts, Eigen::Vector3d::Zero(), kRadius), certificate.ball_lower)
        << seed;
  }
  EXPECT_GE(closed, 2);
}

TEST(GraspCertificate, IsThatOfTheTurnedContacts) {
  // Holding does not depend on the frame, but for the pyramids' edges.
  const Eigen::Matrix3d turn = ExpSO3(Eigen::Vector3d(0.3, -0.8, 0.5));
  CertificateOptions options;
  options.cone_edges = 64;
  std::vector<GraspContact> contacts = Scattered(7, 3);
  const auto before = CertifyContacts(contacts, Eigen::Vector3d(0.01, 0, 0), kRadius, options);
  for (GraspContact& contact : contacts) {
    contact = {turn * contact.point, turn * contact.inward};
  }
  const auto after =
      CertifyContacts(contacts, turn * Eigen::Vector3d(0.01, 0, 0), kRadius, options);
  ASSERT_TRUE(before.least_friction && after.least_friction);
  EXPECT_NEAR(*before.least_friction, *after.least_friction, 0.011);
}

TEST(GraspCertificate, BadOptionsAreRefused) {
  EXPECT_THROW(CertifyContacts(Antipodal(), Eigen::Vector3d::Zero(), 0.0), Error);
  CertificateOptions options;
  options.cone_edges = 2;
  EXPECT_THROW(CertifyContacts(Antipodal(), Eigen::Vector3d::Zero(), 0.1, options), Error);
}

TEST(GraspCertificate, MeshesWithoutVolumeHaveAReason) {
  const Eigen::Vector3d low(-0.05, -0.03, 0.0);
  EXPECT_EQ(WhyNotSolid(testing::Box(low, {0.05, 0.03, 0.02})), "");
  EXPECT_NE(WhyNotSolid(testing::Box(low, {0.05, 0.03, 0.00005})).find("flat"), std::string::npos);
  EXPECT_NE(WhyNotSolid(testing::Sheet(8, 0.01)).find("open"), std::string::npos);
  TriangleMesh bowl = testing::Sphere(0.05, 3);
  Eigen::Index kept = 0;
  for (Eigen::Index f = 0; f < bowl.NumFaces(); ++f) {
    if (bowl.vertices(2, bowl.faces(0, f)) < 0.0) bowl.faces.col(kept++) = bowl.faces.col(f).eval();
  }
  bowl.faces.conservativeResize(3, kept);
  EXPECT_NE(WhyNotSolid(bowl).find("open"), std::string::npos);
  TriangleMesh scanned = testing::Sphere(0.05, 3);  // a face lost
  scanned.faces.conservativeResize(3, scanned.NumFaces() - 1);
  EXPECT_EQ(WhyNotSolid(scanned), "");
  for (const char* name : {"mug", "wineglass", "fryingpan"}) {
    EXPECT_EQ(WhyNotSolid(ReadMesh(HOLDFAST_MESHES_DIR "/objects/" + std::string(name) + ".ply")),
              "")
        << name;
  }
}

TEST(GraspCertificate, PadContactsLieOnTheObject) {
  const HandModel model(BodyModel::Default(), {}, Side::kRight);
  const HandAnatomy anatomy(model);
  HandEvaluation hand = AtWrist(model);
  const HandAngles open = OpenHand(anatomy.axes);
  // A ball in the palm of the open hand, pressed in by a millimeter.
  const TriangleMesh ball = testing::Sphere(0.03, 3);
  const DistanceGrid grid(SignedDistance(ball), {.cell_m = 0.003});
  const FingerPose fingers = anatomy.axes.PoseOf(open);
  const Eigen::Matrix3Xd vertices = hand.At(fingers.data(), false).Vertices();
  Eigen::Vector3d palm = Eigen::Vector3d::Zero();
  for (const int i : anatomy.landmarks.Pad(kPalmPart)) palm += vertices.col(i);
  palm /= static_cast<double>(anatomy.landmarks.Pad(kPalmPart).size());
  std::vector<GraspContact> contacts;
  for (const double side : {1.0, -1.0}) {
    const Eigen::Isometry3d at =
        RigidTransform(Eigen::Matrix3d::Identity(), palm + 0.029 * side * Eigen::Vector3d::UnitY());
    for (const int most : {32, 3}) {
      contacts = PadContacts(anatomy, hand, grid, fingers, at, 0.002, most);
      EXPECT_LE(static_cast<int>(contacts.size()), most);
      for (const GraspContact& contact : contacts) {
        EXPECT_NEAR(contact.point.norm(), 0.03, 0.001);
        EXPECT_NEAR(contact.inward.dot(contact.point.normalized()), -1.0, 0.02);
      }
    }
    EXPECT_FALSE(contacts.empty());
  }
}

}  // namespace
}  // namespace holdfast
