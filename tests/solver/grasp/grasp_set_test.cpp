// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_set.h"

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

const HandModel& RightHand() {
  static const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  return hand;
}

struct Block {
  TriangleMesh mesh = testing::Box({-0.03, -0.02, 0.0}, {0.03, 0.02, 0.09});
  SignedDistance surface{mesh};
  DistanceGrid grid{surface, {.cell_m = 0.003}};
};

const Block& SharedBlock() {
  static const Block block;
  return block;
}

GraspSet Find(int count, int threads, const GraspProgress& progress = {}) {
  GraspSetOptions options;
  options.count = count;
  options.search.turns = 6;
  options.search.threads = threads;
  return FindGrasps(RightHand(), SharedBlock().mesh, SharedBlock().grid, options, progress);
}

TEST(GraspSet, EveryGraspIsValidAndDistinct) {
  const GraspSet set = Find(6, 1);
  ASSERT_EQ(set.status, GraspStatus::kFound);
  ASSERT_EQ(set.grasps.size(), 6u);
  EXPECT_LT((set.mass_center - Eigen::Vector3d(0.0, 0.0, 0.045)).norm(), 1e-9);
  HandEvaluation hand = AtWrist(RightHand());
  for (std::size_t i = 0; i < set.grasps.size(); ++i) {
    const auto& [grasp, contacts] = set.grasps[i];
    // By exact distances, which the grid's differ from by little.
    const Eigen::VectorXd distance = SharedBlock().surface.Distances(
        grasp.wrist_from_object.inverse() * hand.At(grasp.fingers.data(), false).Vertices());
    EXPECT_GT(distance.minCoeff(), -0.0013);
    EXPECT_LT(distance.minCoeff(), 0.002);
    EXPECT_LT(std::max(grasp.max_penetration_mm, grasp.object_in_hand_mm), 1.0);
    ASSERT_TRUE(grasp.certificate);
    ASSERT_TRUE(grasp.certificate->least_friction);
    EXPECT_LE(*grasp.certificate->least_friction, 0.5);
    EXPECT_TRUE(HoldsGravity(contacts, set.mass_center, grasp.certificate->length_m,
                             *grasp.certificate->least_friction));
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_TRUE(AreDistinct(grasp.wrist_from_object, set.grasps[j].grasp.wrist_from_object, 0.02,
                              20.0 * kDegree));
      EXPECT_GE(set.grasps[j].grasp.score, grasp.score);
    }
  }

  // The same on two threads, as arrays.
  const auto arrays = GraspSetArrays(set, "block", Side::kRight);
  EXPECT_EQ(arrays.at("wrist_from_object").shape, (std::vector<std::size_t>{6, 4, 4}));
  EXPECT_EQ(arrays.at("finger_pose").shape, (std::vector<std::size_t>{6, 45}));
  const auto again = GraspSetArrays(Find(6, 2), "block", Side::kRight);
  ASSERT_EQ(arrays.size(), again.size());
  for (const auto& [name, array] : arrays) EXPECT_EQ(array.data, again.at(name).data) << name;
  const std::string csv = GraspSetCsv(set);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 7);
}

// The block is taken across its narrow side, as asked.
TEST(GraspSet, UseAndStyleAreKept) {
  GraspSetOptions options;
  options.count = 6;
  options.search.turns = 6;
  const auto find = [&] {
    return FindGrasps(RightHand(), SharedBlock().mesh, SharedBlock().grid, options);
  };
  // How much of the pressing is along the axis, on average over the contacts of each grasp; least.
  const auto across = [](const GraspSet& set, int axis) {
    double least = 1.0;
    for (const auto& [grasp, contacts] : set.grasps) {
      double sum = 0.0;
      for (const GraspContact& contact : contacts) sum += std::abs(contact.inward(axis));
      least = std::min(least, sum / static_cast<double>(contacts.size()));
    }
    return least;
  };
  options.search.use = GraspUse::kAny;
  GraspSet set = find();
  ASSERT_EQ(set.grasps.size(), 6u);
  EXPECT_EQ(set.use, GraspUse::kAny);
  EXPECT_LT(across(set, 1), 0.4);
  options.search.use = GraspUse::kBox;
  set = find();
  ASSERT_EQ(set.grasps.size(), 6u);
  EXPECT_EQ(set.use, GraspUse::kBox);
  EXPECT_GT(across(set, 1), 0.5);

  options.search.use.reset();
  options.count = 2;
  for (const GraspStyle style : {GraspStyle::kPower, GraspStyle::kPrecision}) {
    options.search.style = style;
    set = find();
    EXPECT_FALSE(set.grasps.empty());
    for (const CertifiedGrasp& one : set.grasps) EXPECT_EQ(one.grasp.style, style);
  }
  options.search.style = GraspStyle::kHandle;
  EXPECT_EQ(find().status, GraspStatus::kNoHandle);
}

TEST(GraspSet, DistinctIsFarOrTurned) {
  const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();
  const auto moved = [](double x, double degrees) {
    return RigidTransform(ExpSO3(degrees * kDegree * Eigen::Vector3d::UnitZ()),
                          Eigen::Vector3d(x, 0.0, 0.0));
  };
  EXPECT_FALSE(AreDistinct(here, moved(0.019, 19.0), 0.02, 20.0 * kDegree));
  EXPECT_TRUE(AreDistinct(here, moved(0.021, 0.0), 0.02, 20.0 * kDegree));
  EXPECT_TRUE(AreDistinct(here, moved(0.0, 21.0), 0.02, 20.0 * kDegree));
}

TEST(GraspSet, StopsAndRefuses) {
  const GraspSet stopped = Find(6, 1, [](double) { return false; });
  EXPECT_EQ(stopped.status, GraspStatus::kStopped);
  EXPECT_TRUE(stopped.grasps.empty());
  // What is found until then is complete.
  const GraspSet some = Find(400, 1, [](double share) { return share < 0.5; });
  EXPECT_EQ(some.status, GraspStatus::kStopped);
  ASSERT_FALSE(some.grasps.empty());
  EXPECT_LT(some.grasps.size(), 400u);
  for (const CertifiedGrasp& one : some.grasps) EXPECT_TRUE(one.grasp.certificate);
  EXPECT_THROW(Find(0, 1), Error);
  const TriangleMesh sheet = testing::Sheet(8, 0.01);
  EXPECT_THROW(FindGrasps(RightHand(), sheet, SharedBlock().grid, {}), Error);
}

}  // namespace
}  // namespace holdfast
