// SPDX-License-Identifier: MIT
// Videos of a clip through the program and the installed ffmpeg.
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/render/video.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::Listing;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;

using RenderVideoFaults = testing::ProgramTest;

bool HasFfmpeg() {
  return std::system("ffmpeg -version >/dev/null 2>&1 && ffprobe -version >/dev/null 2>&1") == 0;
}

// What ffprobe finds after decoding every frame.
nlohmann::json Probe(const ProgramFolder& folder, const std::string& name) {
  const std::string report = (folder / "probe.json").string();
  const std::string command = "ffprobe -v error -count_frames -show_streams -of json '" +
                              (folder / name).string() + "' >'" + report + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  const nlohmann::json probe = nlohmann::json::parse(ReadText(report));
  std::filesystem::remove(report);
  return probe["streams"][0];
}

class RenderVideo : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!HasFfmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  }
  ProgramFolder folder_;
};

TEST_F(RenderVideo, AnMp4HasTheClipsFramesAtItsRateInEvenSize) {
  const ProgramResult result =
      folder_.Run("render demo_drink -o drink.mp4 --size 81x61 --every 4 --json -q");
  const std::size_t frames = nlohmann::json::parse(result.out)["frames"].size();
  EXPECT_EQ(frames, 37u);  // of 145
  const nlohmann::json stream = Probe(folder_, "drink.mp4");
  EXPECT_EQ(stream["codec_name"], "h264");
  EXPECT_EQ(stream["pix_fmt"], "yuv420p");
  EXPECT_EQ(stream["width"], 82);
  EXPECT_EQ(stream["height"], 62);
  EXPECT_EQ(stream["nb_read_frames"], std::to_string(frames));
  EXPECT_EQ(stream["avg_frame_rate"], "15/2");
  EXPECT_LT(ReadText(folder_ / "drink.mp4").find("moov"),
            ReadText(folder_ / "drink.mp4").find("mdat"))
      << "the index is not at the front";
}

TEST_F(RenderVideo, AGifLoopsAndIsTheSameForAnyThreadCount) {
  for (const char* threads : {"1", "3"}) {
    folder_.Run(std::string("render demo_drink -o drink") + threads +
                ".gif --size 60x80 --fps 10 -q --threads " + threads);
  }
  const std::string bytes = ReadText(folder_ / "drink1.gif");
  EXPECT_TRUE(bytes == ReadText(folder_ / "drink3.gif"));
  EXPECT_THAT(bytes, HasSubstr("NETSCAPE2.0"));  // the extension that says loop
  const nlohmann::json stream = Probe(folder_, "drink1.gif");
  EXPECT_EQ(stream["codec_name"], "gif");
  EXPECT_EQ(stream["width"], 60);
  EXPECT_EQ(stream["nb_read_frames"], "49");  // 145 frames at 30 Hz, ten a second
}

TEST_F(RenderVideo, AGifsRateIsLimited) {
  const ProgramResult result =
      folder_.Run("render demo_drink -o drink.gif --size 20x20 --fps 100 --json");
  EXPECT_EQ(nlohmann::json::parse(result.out)["frame_rate_hz"], 50.0);
  EXPECT_THAT(result.err, HasSubstr("using 50 instead of 100"));
}

TEST_F(RenderVideo, ShowsTheFramesInOrder) {
  // Frame k is a gray of its own: the decoded averages must rise with k.
  const auto draw = [](std::span<const int> frames) {
    std::vector<Image> images;
    for (const int k : frames) {
      images.emplace_back(32, 32);
      std::fill(images.back().rgb.begin(), images.back().rgb.end(),
                static_cast<std::uint8_t>(10 * k));
    }
    return images;
  };
  // A .gif takes its palette from a dozen frames: with no more, every gray is in it.
  for (const auto& [name, count] : {std::pair{"gray.mp4", 24}, {"gray.gif", 12}}) {
    ASSERT_TRUE(WriteVideo(folder_ / name, count, 25.0, 5, draw));
    const std::string raw = (folder_ / "raw").string();
    ASSERT_EQ(std::system(("ffmpeg -v error -y -i '" + (folder_ / name).string() +
                           "' -f rawvideo -pix_fmt gray '" + raw + "'")
                              .c_str()),
              0);
    const std::string gray = ReadText(raw);
    ASSERT_EQ(gray.size(), 1024u * static_cast<unsigned>(count)) << name;
    for (int k = 0; k < count; ++k) {
      EXPECT_NEAR(static_cast<std::uint8_t>(gray[static_cast<std::size_t>(k) * 1024 + 500]), 10 * k,
                  4)
          << name << " frame " << k;
    }
  }
}

TEST_F(RenderVideo, StoppingLeavesNothing) {
  int calls = 0;
  const auto draw = [&](std::span<const int> frames) {
    return ++calls > 2 ? std::vector<Image>() : std::vector<Image>(frames.size(), Image(16, 16));
  };
  EXPECT_FALSE(WriteVideo(folder_ / "stopped.mp4", 100, 30.0, 4, draw));
  EXPECT_EQ(Listing(folder_.Path()), "");
}

TEST_F(RenderVideoFaults, WithoutFfmpegThePackageIsNamedAndNothingIsLeft) {
  for (const char* name : {"drink.mp4", "drink.gif"}) {
    const ProgramResult result =
        folder.Run(std::string("render demo_drink --size 20x20 -o ") + name, 1, "PATH=/nowhere");
    EXPECT_THAT(result.err, HasSubstr("ffmpeg: is not installed"));
    EXPECT_THAT(result.err, HasSubstr("Install the package ffmpeg"));
    EXPECT_EQ(Listing(folder.Path()), "");
  }
}

TEST_F(RenderVideoFaults, WhatAFailingFfmpegSaidIsPassedOn) {
  const testing::TemporaryFolder programs;
  const std::filesystem::path fake = programs / "ffmpeg";
  std::ofstream(fake) << "#!/bin/sh\necho 'Unknown encoder libx264' >&2\nexit 1\n";
  ASSERT_EQ(::chmod(fake.c_str(), 0755), 0);
  folder.Fails("render demo_drink --size 20x20 -o drink.mp4", 1, "Unknown encoder libx264",
               "PATH=" + programs.Path().string());
}

TEST_F(RenderVideoFaults, NamesAndRatesThatCannotBe) {
  const auto draw = [](std::span<const int> frames) {
    return std::vector<Image>(frames.size(), Image(17, 16));
  };
  EXPECT_THROW(WriteVideo(folder / "x.avi", 3, 30.0, 4, draw), Error);
  EXPECT_THROW(WriteVideo(folder / "x.mp4", 0, 30.0, 4, draw), Error);
  EXPECT_THROW(WriteVideo(folder / "x.mp4", 3, 0.0, 4, draw), Error);
  EXPECT_THROW(WriteVideo(folder / "x.gif", 3, 60.0, 4, draw), Error);
  EXPECT_THROW(WriteVideo(folder / "x.mp4", 3, 30.0, 4, draw), Error);  // odd
  EXPECT_EQ(Listing(folder.Path()), "");
}

TEST_F(RenderVideoFaults, OtherFormatsAreRefusedBeforeAnyWork) {
  for (const char* name : {"x.jpg", "x%03d.gif", "x"}) {
    folder.Fails(std::string("render demo_drink -o ") + name, 1, "");
  }
}

}  // namespace
}  // namespace holdfast
