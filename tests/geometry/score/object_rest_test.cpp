// SPDX-License-Identifier: MIT
#include "geometry/score/object_rest.h"

#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

// A person with a ball beside, at rest in four frames, at a given height of its center.
struct RestScene {
  explicit RestScene(double height_m) : body(BodyModel::Default()) {
    clip.pose.assign(4, JointPose::Zero());
    clip.trans = Eigen::Vector3d(0.0, 0.0, 1.0).replicate(1, 4);
    clip.object.emplace();
    clip.object->trans = Eigen::Vector3d(2.0, 0.0, height_m).replicate(1, 4);
    clip.object->orient.setZero(3, 4);
  }
  std::vector<std::uint8_t> InAir() const {
    return FramesInMidAir(clip, body, ball, SignedDistance(ball));
  }

  BodySurface body;
  Clip clip;
  TriangleMesh ball = testing::Sphere(0.05, 3);
};

TEST(FramesInMidAir, AreThoseWithoutGroundTableOrSkin) {
  EXPECT_THAT(RestScene(1.0).InAir(), Each(1));
  EXPECT_THAT(RestScene(0.06).InAir(), Each(0)) << "on the ground";

  RestScene on_table(1.0);
  on_table.clip.table = on_table.clip.object;
  EXPECT_THAT(on_table.InAir(), Each(0)) << "a table of unknown shape";
  TriangleMesh board =
      testing::Box(Eigen::Vector3d::Constant(-0.05), Eigen::Vector3d::Constant(0.05));
  on_table.clip.table->surface = std::make_shared<const TriangleMesh>(board);
  on_table.clip.table->trans.row(2).setConstant(1.0 - 0.05 - board.vertices.row(2).maxCoeff());
  EXPECT_THAT(on_table.InAir(), Each(0));
  on_table.clip.table->trans.row(2).array() -= 0.03;
  EXPECT_THAT(on_table.InAir(), Each(1)) << "3 cm above it";

  RestScene on_skin(1.0);
  const Eigen::Vector3d head = on_skin.body.RestJoints().col(15) + on_skin.clip.trans.col(0);
  on_skin.clip.object->trans = head.replicate(1, 4);
  EXPECT_THAT(on_skin.InAir(), Each(0));
}

TEST(FramesInMidAir, AreNotThoseInWhichTheObjectMoves) {
  RestScene thrown(1.0);
  for (int t = 2; t < 4; ++t) thrown.clip.object->trans(2, t) += 0.05 * (t - 1);
  EXPECT_THAT(thrown.InAir(), ElementsAre(1, 1, 0, 0));
}

}  // namespace
}  // namespace holdfast
