// SPDX-License-Identifier: MIT
// The file itself; tests/end_to_end/mujoco_test.cpp has MuJoCo read it.
#include "geometry/io/gltf/mjcf_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

Clip TwoFramesWithObject() {
  Clip clip;
  clip.frame_rate = 20.0;
  clip.pose.assign(2, JointPose::Zero());
  clip.trans = Eigen::Matrix3Xd::Zero(3, 2);
  clip.object.emplace();
  clip.object->trans = Eigen::Matrix3Xd::Zero(3, 2);
  clip.object->trans.col(1) << 0.5, 0, 1;
  clip.object->orient = Eigen::Matrix3Xd::Zero(3, 2);
  return clip;
}

class MjcfWriter : public ::testing::Test {
 protected:
  MjcfReport Write(const TriangleMesh* object, const MjcfOptions& options = {}) {
    const MjcfReport report = WriteMjcf(clip_, surface_, object, options, folder_ / "a.xml");
    text_ = testing::ReadText(folder_ / "a.xml");
    return report;
  }

  TemporaryFolder folder_;
  Clip clip_ = TwoFramesWithObject();
  BodySurface surface_{BodyModel::Default()};
  std::string text_;
};

TEST_F(MjcfWriter, HasABodyForEachJointOfTheHandsAndTheObject) {
  const TriangleMesh cube =
      testing::Box(Eigen::Vector3d::Constant(-0.05), Eigen::Vector3d::Constant(0.05));
  MjcfOptions options;
  options.model_name = "a<b>&\"c\"";
  options.density_kg_m3 = 500.0;
  const MjcfReport report = Write(&cube, options);
  EXPECT_EQ(report.hand_pieces, 32);
  EXPECT_EQ(report.key_frames, 2);
  EXPECT_FALSE(report.mass_of_hull);
  EXPECT_NEAR(report.object_mass_kg, 500.0 * SignedVolume(cube), 1e-9);
  EXPECT_THAT(text_, HasSubstr("model=\"a&#60;b&#62;&#38;&#34;c&#34;\""));
  EXPECT_THAT(text_, HasSubstr("<body name=\"left_thumb3\" mocap=\"true\""));
  EXPECT_THAT(text_,
              HasSubstr("<key name=\"frame_1\" time=\"0.05\" qpos=\"0.5 0 1 1 0 0 0\" mpos="));
  for (const char* name : {"object", "right_wrist", "right_pinky3"}) {
    const TriangleMesh mesh = ReadMesh(folder_ / "a_assets" / (std::string(name) + ".obj"));
    EXPECT_GT(SignedVolume(mesh), 1e-7) << name;
  }
}

// MuJoCo takes no surface that disagrees with itself, and nothing flat.
TEST_F(MjcfWriter, TakesTheHullOfWhatIsNoSolid) {
  const TriangleMesh cube =
      testing::Box(Eigen::Vector3d::Constant(-0.05), Eigen::Vector3d::Constant(0.05));
  TriangleMesh open = cube;
  open.faces.conservativeResize(3, cube.NumFaces() - 1);
  const MjcfReport of_open = Write(&open);
  EXPECT_TRUE(of_open.mass_of_hull);
  EXPECT_FALSE(of_open.mesh_is_hull);
  EXPECT_NEAR(of_open.object_mass_kg, 1000.0 * SignedVolume(cube), 1e-9);
  TriangleMesh twisted = cube;
  std::swap(twisted.faces(0, 0), twisted.faces(1, 0));
  EXPECT_TRUE(Write(&twisted).mesh_is_hull);
  TriangleMesh flat = cube;
  flat.vertices.row(2).setZero();
  EXPECT_THROW(Write(&flat), Error);
}

TEST_F(MjcfWriter, DoesWithoutAnObject) {
  clip_.object.reset();
  EXPECT_EQ(Write(nullptr).object_mass_kg, 0.0);
  EXPECT_THAT(text_, ::testing::Not(HasSubstr("freejoint")));
  EXPECT_THAT(text_, ::testing::Not(HasSubstr("qpos")));
}

}  // namespace
}  // namespace holdfast
