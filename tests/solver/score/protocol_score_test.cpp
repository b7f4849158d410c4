// SPDX-License-Identifier: MIT
#include "solver/score/protocol_score.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/object/load_object.h"
#include "tests/support/carried_scene.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

using testing::CarriedMug;
using ::testing::DoubleNear;
using ::testing::HasSubstr;

MetricValues Scored(const ClipScene& scene, ScoreProtocol protocol,
                    const ClipScene* reference = nullptr) {
  ScoreOptions options;
  options.protocol = protocol;
  options.exact = ExactMode::kOff;
  options.threads = 2;
  SettleScoreOptions(options);
  return ClipValues(ScoreClip(scene, reference, options), options);
}

TriangleMesh Centered(TriangleMesh mesh) {
  const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff();
  mesh.vertices.colwise() -= 0.5 * (low + high);
  return mesh;
}

// Minimum of GraspQP's program by coordinate descent, which converges for a convex quadratic with
// bounds.
double PlainGraspQp(const std::vector<ProtocolContact>& contacts, const Eigen::Vector3d& center) {
  const auto n = static_cast<Eigen::Index>(4 * contacts.size());
  Eigen::MatrixXd F(6, n);
  for (Eigen::Index g = 0; g < n; ++g) {
    const ProtocolContact& contact = contacts[static_cast<std::size_t>(g / 4)];
    const Eigen::Vector3d u = contact.into.unitOrthogonal(), v = contact.into.cross(u);
    const Eigen::Vector3d side = g % 4 == 0 ? u : g % 4 == 1 ? v : g % 4 == 2 ? -u : -v;
    const Eigen::Vector3d force = 0.25 * (std::sqrt(0.96) * contact.into + 0.2 * side);
    F.col(g) << force, 5.0 * (contact.point - center).cross(force);
  }
  Eigen::VectorXd x = Eigen::VectorXd::Ones(n);
  for (int sweep = 0; sweep < 100'000; ++sweep) {
    for (Eigen::Index g = 0; g < n; ++g) {
      const double slope = F.col(g).dot(F * x) + 1e-4 * x(g);
      x(g) = std::clamp(x(g) - slope / (F.col(g).squaredNorm() + 1e-4), 1.0, 21.0);
    }
  }
  return 0.5 * (F * x).squaredNorm();
}

TEST(SurfaceVoxels, AreThoseThatASurfacePassesThrough) {
  // A cube from -50 to 50 mm touches the cells -10 to 10 of 5 mm: a hollow cube of 21.
  TriangleMesh cube = Centered(LoadObject("cube").mesh);
  for (int axis = 0; axis < 3; ++axis) {
    cube.vertices.row(axis) *= 0.05 / cube.vertices.row(axis).maxCoeff();
  }
  const Eigen::Matrix3Xd voxels = SurfaceVoxels(cube, 0.005);
  EXPECT_EQ(voxels.cols(), 21 * 21 * 21 - 19 * 19 * 19);
  EXPECT_NEAR(voxels.cwiseAbs().maxCoeff(), 0.05, 1e-12);
}

TEST(FarthestPoints, AreEvenlyApart) {
  const TriangleMesh sphere = Centered(LoadObject("sphere").mesh);
  const Eigen::Matrix3Xd points = FarthestPoints(sphere, 200);
  const double radius = sphere.vertices.colwise().norm().maxCoeff();
  double nearest = radius;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      nearest = std::min(nearest, (points.col(i) - points.col(j)).norm());
    }
  }
  // 200 circles that cover a sphere without overlap are 0.27 radii in diameter at most.
  EXPECT_GT(nearest, 0.17 * radius);
  EXPECT_LT(nearest, 0.28 * radius);
}

TEST(GraspQp, IsZeroForContactsThatBalanceAndTheMinimumForOthers) {
  using V = Eigen::Vector3d;
  const V center(0.01, 0.02, 0.03);
  const ProtocolContact left{center - 0.04 * V::UnitX(), V::UnitX()};
  const ProtocolContact right{center + 0.04 * V::UnitX(), -V::UnitX()};
  EXPECT_NEAR(GraspQpValue({left, right}, center), 0.0, 1e-9);
  // One contact pushes with the least of its four edges, a quarter of a unit each.
  EXPECT_NEAR(GraspQpValue({left}, center), 0.5 * 0.96, 1e-6);
  EXPECT_FALSE(std::isfinite(GraspQpValue({}, center)));
  const std::vector<ProtocolContact> uneven = {
      left,
      {center + V(0.0, 0.05, 0.01), V(0.1, -1.0, 0.2).normalized()},
      {center + V(0.02, -0.03, 0.02), V(-0.5, 0.6, -0.4).normalized()},
      {center + V(0.0, 0.01, -0.05), V(0.0, 0.2, 1.0).normalized()}};
  // A dozen contacts of which most push from one side.
  std::vector<ProtocolContact> dozen;
  for (int k = 0; k < 12; ++k) {
    const V way = V(std::cos(k), std::sin(1.7 * k), 0.3 + 0.1 * (k % 5)).normalized();
    dozen.push_back({center + 0.04 * way, -way});
  }
  for (const auto& contacts : {uneven, dozen}) {
    const double plain = PlainGraspQp(contacts, center);
    EXPECT_GT(plain, 1e-3);
    EXPECT_THAT(GraspQpValue(contacts, center), DoubleNear(plain, 1e-3 * plain));
  }
}

TEST(SupportedDirections, GrowWithTheContacts) {
  using V = Eigen::Vector3d;
  EXPECT_EQ(SupportedDirections({}, 0.05), 0.0);
  std::vector<ProtocolContact> contacts;
  double last = 0.0;
  for (const V& axis : {V(V::UnitX()), V(-V::UnitX()), V(V::UnitY()), V(-V::UnitY()), V(V::UnitZ()),
                        V(-V::UnitZ())}) {
    contacts.push_back({-0.05 * axis + 0.01 * V(axis.z(), axis.x(), axis.y()), axis});
    const double share = SupportedDirections(contacts, 0.05);
    EXPECT_GE(share, last);
    last = share;
  }
  EXPECT_GT(last, 0.95);
  EXPECT_NEAR(SupportedDirections({contacts[0]}, 0.05), 0.55, 0.06);  // a little over half
}

TEST(ScoreByProtocol, AgreesWithTheUsualMeasures) {
  ClipScene scene = CarriedMug(4);
  // Moves the mug by 1 cm, so that the hand goes deep into it.
  scene.clip.object->trans.row(0).array() += 0.01;
  const MetricValues grab = Scored(scene, ScoreProtocol::kGrab);
  const MetricValues solid = Scored(scene, ScoreProtocol::kContactOpt);
  EXPECT_GT(grab.at("grab_depth_cm"), 0.2);
  EXPECT_LE(grab.at("grab_depth_cm"), 0.1 * grab.at("penetration_max_mm").value() + 1e-12);
  EXPECT_EQ(grab.at("grab_contact_ratio"), 1.0);
  EXPECT_FALSE(solid.contains("grab_depth_cm"));
  const double voxels = solid.at("intersection_volume_voxel_cm3").value();
  EXPECT_GT(voxels, 0.5);
  EXPECT_THAT(solid.at("contactopt_volume_cm3").value(), DoubleNear(voxels, 0.1 * voxels));
  EXPECT_GT(solid.at("contactopt_coverage_ratio"), 0.0);
  const MetricValues points = Scored(scene, ScoreProtocol::kDexGraspNet);
  EXPECT_GT(points.at("dexgraspnet_penetration_sum_m"), 1e-3);
  EXPECT_EQ(points.at("dexgraspnet_penetration_ok_ratio"), 0.0);
  EXPECT_THAT(points.at("dexgraspnet_penetration_max_mm").value(),
              DoubleNear(points.at("object_in_hand_max_mm").value(), 2.0));
  for (const ScoreProtocol protocol : {ScoreProtocol::kGraspQp, ScoreProtocol::kV2d}) {
    const MetricValues values = Scored(scene, protocol);
    for (const MetricDefinition& metric : ProtocolMetrics(protocol)) {
      EXPECT_TRUE(values.contains(metric.key)) << metric.key;
    }
  }
}

TEST(ScoreByProtocol, ComparesTheObjectsPath) {
  const ClipScene reference = CarriedMug(4);
  ClipScene moved = reference;
  moved.clip.object->trans.row(2).array() += 0.0501;
  const MetricValues values = Scored(moved, ScoreProtocol::kV2d, &reference);
  EXPECT_EQ(values.at("v2d_sp_success_ratio"), 1.0);
  EXPECT_EQ(values.at("v2d_mt_success_ratio"), 0.0);
  // Every frame is within 6 to 9 cm and none within 5: 3.5 of 8 cm.
  EXPECT_THAT(values.at("v2d_add_auc_ratio").value(), DoubleNear(3.5 / 8.0, 1e-12));
}

TEST(ScoreByProtocol, RefusesAnObjectInMillimeters) {
  ClipScene scene = CarriedMug(2);
  scene.object->vertices *= 1000.0;
  EXPECT_THAT(testing::ErrorText([&] { Scored(scene, ScoreProtocol::kContactOpt); }),
              HasSubstr("too large for the voxels"));
}

TEST(ScoreByProtocol, HasNothingToSayOfAClipWithoutObject) {
  ClipScene scene = CarriedMug(4);
  scene.clip.object.reset();
  const MetricValues values = Scored(scene, ScoreProtocol::kGrab);
  EXPECT_FALSE(values.at("grab_depth_cm").has_value());
}

}  // namespace
}  // namespace holdfast
