// SPDX-License-Identifier: MIT
#include "geometry/render/clip_pictures.h"

#include <filesystem>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

Clip Standing(int frames) {
  Clip clip;
  clip.frame_rate = 120.0;
  clip.pose.assign(static_cast<std::size_t>(frames), JointPose::Zero());
  clip.trans = Eigen::Matrix3Xd::Zero(3, frames);
  return clip;
}

ClipPictureOptions Tiny() {
  ClipPictureOptions options;
  options.size = {15, 15};
  options.how.picture.supersampling = 1;
  return options;
}

TEST(ClipPictures, NamesSayWhatIsWritten) {
  EXPECT_EQ(PictureFileOf("a.gif").video, VideoFormat::kGif);
  EXPECT_TRUE(PictureFileOf("a_%03d.png").numbered);
  EXPECT_FALSE(PictureFileOf("a.PNG").numbered);
  EXPECT_THROW(PictureFileOf("a.jpg"), Error);
  EXPECT_THROW(PictureFileOf("a_%d.mp4"), Error);
}

TEST(ClipPictures, FormatsGetTheFramesSizesAndRatesThatTheyHave) {
  const Clip clip = Standing(120);
  ClipPictureOptions options = Tiny();
  const ClipPictures gif = PlanPictures(clip, PictureFileOf("a.gif"), options);
  EXPECT_EQ(gif.frame_rate, kMaxGifRate);
  EXPECT_EQ(gif.frames.size(), 50u);
  EXPECT_NE(gif.note.find("at most 50 frames per second"), std::string::npos) << gif.note;
  EXPECT_EQ(gif.how.picture.width, 15);
  const ClipPictures mp4 = PlanPictures(clip, PictureFileOf("a.mp4"), options);
  EXPECT_EQ(mp4.frame_rate, 120.0);
  EXPECT_EQ(mp4.how.picture.width, 16);
  EXPECT_EQ(PlanPictures(clip, PictureFileOf("a.png"), options).frames.size(), 8u);
  options.every = 50;
  EXPECT_EQ(PlanPictures(clip, PictureFileOf("a_%d.png"), options).frames,
            (std::vector<int>{0, 50, 100}));
  options.frame = 7;
  EXPECT_EQ(PlanPictures(clip, PictureFileOf("a.gif"), options).frames, std::vector<int>{7});
  options.frame = 120;
  EXPECT_THROW(PlanPictures(clip, PictureFileOf("a.png"), options), Error);
  options.frame.reset();
  options.fps = 30.0;  // with every = 50
  EXPECT_THROW(PlanPictures(clip, PictureFileOf("a.gif"), options), Error);
}

TEST(ClipPictures, StopWhereProgressSaysSo) {
  const testing::TemporaryFolder folder;
  const Clip clip = Standing(6);
  const ClipRenderer renderer(clip, BodyModel::Default(), Eigen::VectorXd(), nullptr);
  ClipPictureOptions options = Tiny();
  options.threads = 2;
  const PictureFile sheet = PictureFileOf(folder.Path() / "sheet.png");
  int told = 0;
  EXPECT_FALSE(
      WritePictures(renderer, PlanPictures(clip, sheet, options), [&](int done, int total) {
        EXPECT_EQ(total, 6);
        EXPECT_EQ(done, ++told);
        return done < 2;
      }));
  EXPECT_EQ(told, 2);
  EXPECT_FALSE(std::filesystem::exists(sheet.path));

  const PictureFile numbered = PictureFileOf(folder.Path() / "%02d.png");
  EXPECT_TRUE(WritePictures(renderer, PlanPictures(clip, numbered, options)));
  for (int t = 0; t < 6; ++t) {
    EXPECT_TRUE(std::filesystem::exists(numbered.numbered->Name(t))) << t;
  }
}

}  // namespace
}  // namespace holdfast
