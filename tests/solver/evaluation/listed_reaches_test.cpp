// SPDX-License-Identifier: MIT
#include "solver/evaluation/listed_reaches.h"

#include <fstream>

#include <gtest/gtest.h>

#include "generator/wandr/reach_network.h"
#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

class ReachList : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& text) const {
    std::ofstream(folder.Path() / "list.csv") << text;
    return folder.Path() / "list.csv";
  }
  void SetUp() override {
    ReachPerson person = StandingPerson(BodyModel::Default());
    Clip clip = person.like;
    clip.pose.assign(20, clip.pose.empty() ? JointPose::Zero() : clip.pose.front());
    for (JointPose& pose : clip.pose) pose(0, 0) = 1.5707963267948966;
    clip.trans = Eigen::Matrix3Xd::Zero(3, 20);
    clip.trans.row(2).setConstant(1.3);
    clip.trans.colwise() -= kEmbeddedRestPelvis;
    WriteClip(clip, folder.Path() / "stands.npz");
  }
  testing::TemporaryFolder folder;
};

TEST_F(ReachList, HasAStartAndAGoalInEachLine) {
  const auto listed = ReadListedReaches(
      Write("clip,frame,ahead,left,up\nstands.npz,3,1.5,-0.5,1.1\r\n"), folder.Path());
  ASSERT_EQ(listed.size(), 1u);
  EXPECT_EQ(listed[0].frame, 3);
  EXPECT_EQ(listed[0].ahead_left_up, Eigen::Vector3d(1.5, -0.5, 1.1));
}

TEST_F(ReachList, FaultsAreNamedByLine) {
  for (const char* line : {"stands.npz,3,1.5,-0.5", "stands.npz,-1,1,1,1", "stands.npz,0.5,1,1,1",
                           "stands.npz,1,1,1,x", "nobody.npz,1,1,1,1", ",1,1,1,1"}) {
    try {
      ReadListedReaches(Write(std::string("clip,frame,ahead,left,up\n") + line), folder.Path());
      ADD_FAILURE() << line;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(":2"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(ReadListedReaches(Write("a,b\n"), folder.Path()), Error);
  EXPECT_THROW(ReadListedReaches(Write("clip,frame,ahead,left,up\n"), folder.Path()), Error);
}

TEST_F(ReachList, TheGoalIsByTheHeadingAndAReachComesToIt) {
  if (!wandr::HasDefaultNetwork()) GTEST_SKIP() << "built without networks";
  ReachOptions options;
  options.samples = 8;
  const ListedMotion made = MakeListedReach({folder.Path() / "stands.npz", 10, {1.5, 0.5, 1.1}},
                                            BodyModel::Default(), wandr::DefaultNetwork(), options);
  EXPECT_NEAR(made.goal.x(), 0.5, 0.01);  // faces -y: left is +x
  EXPECT_NEAR(made.goal.y(), -1.5, 0.1);
  EXPECT_NEAR(made.goal.z(), 1.1, 1e-9);
  EXPECT_TRUE(made.reached);
}

}  // namespace
}  // namespace holdfast
