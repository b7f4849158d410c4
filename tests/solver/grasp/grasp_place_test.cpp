// SPDX-License-Identifier: MIT
// Grasps where they are asked for: on a part of an object, off one, near a point.
#include "solver/grasp/grasp_placement.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "solver/grasp/grasp.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

using testing::Box;
using ::testing::HasSubstr;
using testing::Together;

// A sword that stands on its pommel: the hilt below z = 0, a guard and the blade above.
const TriangleMesh kHilt = Box({-0.014, -0.011, -0.2}, {0.014, 0.011, 0.0});
const TriangleMesh kGuard = Box({-0.08, -0.014, 0.0}, {0.08, 0.014, 0.02});
const TriangleMesh kBlade = Box({-0.024, -0.003, 0.02}, {0.024, 0.003, 0.75});
const TriangleMesh kSword = Together(Together(kHilt, kGuard), kBlade);

struct Held {
  Grasp grasp;
  GraspReport report;
  Eigen::Matrix3Xd contacts;  // skin within 5 mm of the surface, in the object's frame
};

Held Hold(const TriangleMesh& mesh, std::shared_ptr<const GraspPlace> place) {
  static const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  const SignedDistance surface(mesh);
  const DistanceGrid grid(surface, {.cell_m = 0.0025, .threads = 2});
  GraspOptions options;
  options.oppositions = 24;
  options.closings = 100;
  options.refinements = 16;
  options.threads = 2;
  options.place = std::move(place);
  Held held;
  held.grasp = CloseHand(hand, mesh, surface, grid, options, &held.report);
  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd vertices = held.grasp.wrist_from_object.inverse() *
                                    evaluation.At(held.grasp.fingers.data(), false).Vertices();
  const Eigen::VectorXd distance = surface.Distances(vertices, 2);
  std::vector<Eigen::Index> near;
  for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
    if (distance[i] < 0.005) near.push_back(i);
  }
  held.contacts = vertices(Eigen::all, near);
  return held;
}

double ShareBelow(const Held& held, double z) {
  return (held.contacts.row(2).array() < z).cast<double>().mean();
}

TEST(GraspPlace, ASwordIsHeldByItsHiltAndOffItsBlade) {
  // Left to itself the hand takes the blade, which is nearer to the middle.
  const Held anywhere = Hold(kSword, nullptr);
  EXPECT_EQ(anywhere.report.status, GraspStatus::kFound);
  EXPECT_LT(ShareBelow(anywhere, 0.02), 0.5);

  const Held hilt =
      Hold(kSword, std::make_shared<GraspPlace>(kSword, GraspPlace::Wanted{kHilt, {}, {}}));
  ASSERT_EQ(hilt.report.status, GraspStatus::kFound);
  EXPECT_GT(hilt.contacts.cols(), 20);
  EXPECT_GE(ShareBelow(hilt, 0.0), 0.9);
  EXPECT_LE(hilt.grasp.outside_place, 0.1);

  const Held off =
      Hold(kSword, std::make_shared<GraspPlace>(kSword, GraspPlace::Wanted{{}, kBlade, {}}));
  ASSERT_EQ(off.report.status, GraspStatus::kFound);
  EXPECT_GE(ShareBelow(off, 0.02), 0.9);
}

TEST(GraspPlace, AHandStaysOutOfABall) {
  GraspPlace::Wanted wanted;
  wanted.avoid_balls = {{{0.0, 0.0, -0.1}, 0.11}};  // the hilt
  const GraspPlace place(kSword, wanted);
  EXPECT_FALSE(place.IsRequired());
  EXPECT_FALSE(place.Allows({0.014, 0.0, -0.1}));
  EXPECT_TRUE(place.Allows({0.024, 0.0, 0.3}));
  const Held off = Hold(kSword, std::make_shared<GraspPlace>(kSword, wanted));
  ASSERT_EQ(off.report.status, GraspStatus::kFound);
  EXPECT_LE(off.grasp.outside_place, 0.1);
  EXPECT_LT(off.grasp.in_keep_free, 0.1);
  EXPECT_GE(1.0 - ShareBelow(off, 0.0), 0.9);
}

TEST(GraspPlace, APointMovesTheGrasp) {
  const TriangleMesh bottle = ReadMesh(HOLDFAST_MESHES_DIR "/objects/bottle.ply");
  const double top = bottle.vertices.row(2).maxCoeff(), bottom = bottle.vertices.row(2).minCoeff();
  // On the wall, near the top and near the bottom.
  const auto wall = [&](double z) {
    Eigen::Index nearest = 0;
    (bottle.vertices.row(2).array() - z).abs().minCoeff(&nearest);
    return Eigen::Vector3d(bottle.vertices.col(nearest));
  };
  double middle[2];
  for (int k = 0; k < 2; ++k) {
    const double z = k == 0 ? bottom + 0.06 : top - 0.04;
    GraspPlace::Wanted wanted;
    wanted.at = wall(z);
    const Held held = Hold(bottle, std::make_shared<GraspPlace>(bottle, wanted));
    ASSERT_EQ(held.report.status, GraspStatus::kFound);
    middle[k] = held.contacts.row(2).mean();
    EXPECT_NEAR(middle[k], z, 0.06);
    EXPECT_LE(held.grasp.from_place_m, GraspPlace::kReach_m);
  }
  EXPECT_GT(middle[1] - middle[0], 0.06);
}

TEST(GraspPlace, SaysThatAPlaceCannotBeHeld) {
  const TriangleMesh chest = Together(Box({0.5, 0, 0}, {0.8, 0.3, 0.3}), kSword);
  const auto place = std::make_shared<GraspPlace>(
      chest, GraspPlace::Wanted{Box({0.5, 0, 0}, {0.8, 0.3, 0.3}), {}, {}});
  EXPECT_EQ(Hold(chest, place).report.status, GraspStatus::kNothingAtPlace);
}

TEST(GraspPlace, RefusesWhatIsNoPlaceOfTheObject) {
  const auto why = [](const GraspPlace::Wanted& wanted) {
    return testing::ErrorText([&] { GraspPlace(kSword, wanted); });
  };
  GraspPlace::Wanted far;
  far.at = Eigen::Vector3d(0.0, 0.2, 0.5);
  EXPECT_THAT(why(far), HasSubstr("(0, 0.2, 0.5) is 19.7 cm from the object's surface"));
  far.at->y() = std::nan("");
  EXPECT_THAT(why(far), HasSubstr("not finite"));
  EXPECT_THAT(why({Box({1, 1, 1}, {2, 2, 2}), {}, {}}), HasSubstr("leaves no surface"));
  EXPECT_THAT(why({kHilt, kSword, {}}), HasSubstr("leaves no surface"));
  EXPECT_EQ(why({kHilt, kBlade, {}}), "no error");
  GraspPlace::Wanted balls;
  balls.avoid_balls = {{{0.0, 0.3, 0.5}, 0.1}};
  EXPECT_THAT(why(balls), HasSubstr("farther than the radius of 0.1 m"));
  balls.avoid_balls = {{{0.0, 0.0, 0.3}, 2.0}};
  EXPECT_THAT(why(balls), HasSubstr("leaves no surface"));
}

}  // namespace
}  // namespace holdfast
