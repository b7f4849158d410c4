// SPDX-License-Identifier: MIT
#include "geometry/render/clip_pictures.h"

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

// A person at rest turned into the world, with a small cube somewhere.
Clip StandingClip(const Eigen::Vector3d& object_at) {
  Clip clip;
  JointPose pose = JointPose::Zero();
  pose(0, 0) = 1.5707963267948966;
  clip.pose.assign(3, pose);
  clip.trans = Eigen::Vector3d(0.0, 0.0, 0.88).replicate(1, 3);
  ObjectTrack track;
  track.trans = object_at.replicate(1, 3);
  track.orient = Eigen::Matrix3Xd::Zero(3, 3);
  track.name = "cube";
  clip.object = track;
  return clip;
}

TriangleMesh Cube(double half) {
  return testing::Box(Eigen::Vector3d::Constant(-half), Eigen::Vector3d::Constant(half));
}

ClipRenderOptions Small(ClipView view) {
  ClipRenderOptions options;
  options.view = view;
  options.picture.width = 160;
  options.picture.height = 160;
  return options;
}

int CountPixels(const Image& image, bool (*matches)(const std::uint8_t*)) {
  int count = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) count += matches(&image.rgb[i]) ? 1 : 0;
  return count;
}

bool Red(const std::uint8_t* p) { return p[0] > p[1] + 70 && p[0] > p[2] + 70; }
bool Blue(const std::uint8_t* p) { return p[2] > p[0] + 40; }

TEST(ClipRenderer, EveryViewShowsTheBodyAndTheObject) {
  const auto body = BodyModel::Default();
  const TriangleMesh cube = Cube(0.06);
  const ClipRenderer renderer(StandingClip({-0.75, -0.02, 1.45}), body, {}, &cube);
  for (const ClipView view :
       {ClipView::kAuto, ClipView::kFront, ClipView::kSide, ClipView::kFollow, ClipView::kHand}) {
    const Image image = renderer.Draw(1, Small(view));
    EXPECT_GT(CountPixels(image, Blue), 5) << static_cast<int>(view);
  }
}

// The person with the object in front of it, turned about the vertical: the same picture but for
// the light; one who turns by less than half a quarter is seen turned.
TEST(ClipRenderer, FrontAndSideAreThePersons) {
  const auto body = BodyModel::Default();
  const TriangleMesh cube = Cube(0.1);
  const auto turned = [&](double degrees, ClipView view) {
    const Eigen::Matrix3d R = ExpSO3(Eigen::Vector3d::UnitZ() * degrees * kDegree);
    Clip clip = StandingClip(R * Eigen::Vector3d(-0.1, -0.4, 1.2));
    for (JointPose& pose : clip.pose) {
      pose.col(0) = LogSO3(R * ExpSO3(Eigen::Vector3d(pose.col(0))));
    }
    clip.object->orient.colwise() = Eigen::Vector3d(Eigen::Vector3d::UnitZ() * degrees * kDegree);
    const BodySurface surface(body, {});
    const Eigen::Vector3d pelvis = surface.RestJoints().col(0);
    clip.trans.colwise() += R * pelvis - pelvis;
    return CountPixels(ClipRenderer(clip, body, {}, &cube).Draw(0, Small(view)), Blue);
  };
  for (const ClipView view : {ClipView::kFront, ClipView::kSide}) {
    const int usual = turned(0.0, view);
    EXPECT_GT(usual, 50);
    for (const double degrees : {90.0, 180.0, -90.0}) {
      EXPECT_NEAR(turned(degrees, view), usual, 0.15 * usual) << degrees;
    }
  }
}

TEST(ClipRenderer, SheetsFollowWhoWalks) {
  Clip clip = StandingClip(Eigen::Vector3d::Zero());
  EXPECT_EQ(SheetView(clip), ClipView::kFront);
  clip.trans(0, 1) += 0.9;  // a step aside and back
  EXPECT_EQ(SheetView(clip), ClipView::kFront);
  clip.trans(0, 1) += 0.2;
  EXPECT_EQ(SheetView(clip), ClipView::kFollow);
  clip.trans(0, 1) -= 1.1;
  clip.trans(2, 2) += 3.0;  // up alone is no walk
  EXPECT_EQ(SheetView(clip), ClipView::kFront);
}

TEST(ClipRenderer, SkinInsideTheObjectIsRed) {
  const auto body = BodyModel::Default();
  // Around the right hand, its far wall cutting the fingers open to view from the front.
  const BodySurface surface(body, {});
  const Eigen::Vector3d pelvis = surface.RestJoints().col(0);
  const Eigen::Vector3d knuckle = surface.RestJoints().col(kRightHandBegin + 3) - pelvis;
  const Eigen::Vector3d at =
      pelvis + Eigen::Vector3d(knuckle.x(), 0.035 - knuckle.z(), knuckle.y() + 0.88);
  const TriangleMesh cube = Cube(0.04);
  const ClipRenderer renderer(StandingClip(at), body, {}, &cube);
  ClipRenderOptions options = Small(ClipView::kHand);
  options.azimuth_deg = 0.0;
  EXPECT_GT(CountPixels(renderer.Draw(0, options), Red), 10);
  options.show_contact = false;
  EXPECT_EQ(CountPixels(renderer.Draw(0, options), Red), 0);
}

TEST(ClipRenderer, ShowsWhatTheObjectStoodOn) {
  const auto body = BodyModel::Default();
  Clip clip = StandingClip(Eigen::Vector3d::Zero());
  clip.table = clip.object;
  clip.table->trans.colwise() += Eigen::Vector3d(0.9, 0.0, 0.5);
  const Image without = ClipRenderer(clip, body, {}, nullptr).Draw(0, Small(ClipView::kFollow));
  clip.table->surface = std::make_shared<const TriangleMesh>(Cube(0.2));
  const Image with = ClipRenderer(clip, body, {}, nullptr).Draw(0, Small(ClipView::kFollow));
  int differing = 0;
  for (std::size_t i = 0; i < with.rgb.size(); ++i) differing += with.rgb[i] != without.rgb[i];
  EXPECT_GT(differing, 300);
}

TEST(ClipRenderer, ShowsMarkersThatAreSeen) {
  const auto green = [](const std::uint8_t* p) { return p[1] > p[0] + 30 && p[1] > p[2] + 10; };
  const ClipRenderer renderer(StandingClip({0, 0, 0}), BodyModel::Default(), {}, nullptr);
  ClipRenderOptions options = Small(ClipView::kFront);
  options.picture.width = options.picture.height = 480;
  EXPECT_EQ(CountPixels(renderer.Draw(1, options), green), 0);
  options.markers.resize(6, 3);
  options.markers.topRows<3>() = Eigen::Vector3d(0.3, -0.3, 1.2).replicate(1, 3);
  options.markers.bottomRows<3>().setConstant(std::nan(""));
  const int one = CountPixels(renderer.Draw(1, options), green);
  EXPECT_GT(one, 3);
  EXPECT_LT(one, 60);
  options.markers.conservativeResize(6, 2);
  EXPECT_THROW(renderer.Draw(1, options), Error);
}

// A goal colors what is behind it, and hides it only in half.
TEST(ClipRenderer, GoalsAreTranslucent) {
  const ClipRenderer renderer(StandingClip({0, 0, 0}), BodyModel::Default(), {}, nullptr);
  ClipRenderOptions options = Small(ClipView::kFront);
  const Image without = renderer.Draw(1, options);
  options.goals = Eigen::Vector3d(0.0, -0.3, 1.1);
  const Image with = renderer.Draw(1, options);
  int changed = 0;
  for (std::size_t i = 0; i < with.rgb.size(); i += 3) {
    if (std::equal(&with.rgb[i], &with.rgb[i] + 3, &without.rgb[i])) continue;
    ++changed;
    EXPECT_LT(std::abs(with.rgb[i + 2] - without.rgb[i + 2]), 110);
  }
  EXPECT_GT(changed, 80);                                 // 10 cm of some 2 m
  options.goals = Eigen::MatrixXd::Constant(3, 3, 50.0);  // one that moves: far away but in frame 1
  options.goals.col(1) = Eigen::Vector3d(0.0, -0.3, 1.1);
  EXPECT_EQ(renderer.Draw(1, options).rgb, with.rgb);
  EXPECT_NE(renderer.Draw(2, options).rgb, with.rgb);
}

// From the default direction, in front, a wall hides hand and object.
TEST(ClipRenderer, TheCloseUpLooksFromWhereHandAndObjectAreSeen) {
  const auto body = BodyModel::Default();
  const TriangleMesh cube = Cube(0.04);
  Clip clip = StandingClip({-0.75, -0.02, 1.45});
  clip.holding_hand.assign(3, kHoldsRight);
  clip.table = clip.object;
  clip.table->trans.colwise() = Eigen::Vector3d(-0.8, -0.4, 1.45);
  clip.table->surface =
      std::make_shared<const TriangleMesh>(testing::Box({-0.6, -0.01, -0.5}, {0.6, 0.01, 0.5}));
  const ClipRenderer renderer(clip, body, {}, &cube);
  ClipRenderOptions options = Small(ClipView::kHand);
  const Image chosen = renderer.Draw(1, options);
  EXPECT_GT(CountPixels(chosen, Blue), 200);
  options.azimuth_deg = 20.0;
  EXPECT_EQ(CountPixels(renderer.Draw(1, options), Blue), 0);
  // One direction for the clip: that of the frame, since all frames are the same.
  const std::vector<int> all = {0, 1, 2};
  options.azimuth_deg.reset();
  options.hand_direction_rad = renderer.HandDirection(all, 2);
  EXPECT_EQ(renderer.Draw(1, options).rgb, chosen.rgb);
}

TEST(ClipRenderer, RefusesWhatIsNotThere) {
  const auto body = BodyModel::Default();
  const TriangleMesh cube = Cube(0.05);
  Clip clip = StandingClip(Eigen::Vector3d::Zero());
  const ClipRenderer renderer(clip, body, {}, nullptr);
  EXPECT_THROW(renderer.Draw(3, Small(ClipView::kFront)), Error);
  EXPECT_THROW(renderer.Draw(-1, Small(ClipView::kFront)), Error);
  clip.object.reset();
  EXPECT_THROW(ClipRenderer(clip, body, {}, &cube), Error);
}

}  // namespace
}  // namespace holdfast
