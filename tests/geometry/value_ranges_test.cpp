// SPDX-License-Identifier: MIT
#include "geometry/options.h"

#include "geometry/clip/clip.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/mesh/mesh.h"

#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;

Clip SoundClip() {
  Clip clip;
  clip.pose.assign(3, JointPose::Zero());
  clip.trans.setZero(3, 3);
  clip.betas.setZero(10);
  clip.v_template.setZero(3, 5);
  clip.object = ObjectTrack{Eigen::Matrix3Xd::Zero(3, 3), Eigen::Matrix3Xd::Zero(3, 3), "", ""};
  clip.table = clip.object;
  return clip;
}

std::string FaultOf(const Clip& clip) {
  return testing::ErrorText([&] { RequireInRange(clip, "a.npz"); });
}

Clip WithRate(double hertz) {
  Clip clip = SoundClip();
  clip.frame_rate = hertz;
  return clip;
}

TEST(ValueRanges, HoldEveryNumberOfAClip) {
  struct Field {
    const char* named;
    double most;
    std::function<double&(Clip&)> at;
  };
  const std::vector<Field> fields = {
      {"a.npz[trans]: holds", kMaxMeters, [](Clip& c) -> double& { return c.trans(1, 2); }},
      {"a.npz: rotates right_knee by", kMaxRadians,
       [](Clip& c) -> double& { return c.pose[2](0, 5); }},
      {"a.npz[betas]", kMaxBeta, [](Clip& c) -> double& { return c.betas[9]; }},
      {"a.npz[v_template]", kMaxMeters, [](Clip& c) -> double& { return c.v_template(2, 4); }},
      {"a.npz[object_trans]", kMaxMeters, [](Clip& c) -> double& { return c.object->trans(0, 1); }},
      {"a.npz[object_orient]", kMaxRadians,
       [](Clip& c) -> double& { return c.object->orient(0, 1); }},
      {"a.npz[table_trans]", kMaxMeters, [](Clip& c) -> double& { return c.table->trans(0, 1); }},
      {"a.npz[table_orient]", kMaxRadians,
       [](Clip& c) -> double& { return c.table->orient(0, 1); }}};
  for (const Field& field : fields) {
    for (const double sound : {-field.most, field.most}) {
      Clip clip = SoundClip();
      field.at(clip) = sound;
      EXPECT_EQ(FaultOf(clip), "no error");
    }
    for (const double wrong : {1.001 * field.most, -1e300, double(INFINITY), double(NAN)}) {
      Clip clip = SoundClip();
      field.at(clip) = wrong;
      EXPECT_THAT(FaultOf(clip), HasSubstr(field.named)) << wrong;
    }
  }
  for (const double rate : {1.0, 30.0, 1e4}) EXPECT_EQ(FaultOf(WithRate(rate)), "no error");
  for (const double rate : {0.0, -30.0, 1e-9, 1.1e4, double(INFINITY), double(NAN)}) {
    EXPECT_THAT(FaultOf(WithRate(rate)), HasSubstr("frames per second")) << rate;
  }
}

TEST(ValueRanges, TheFirstValueBeyondIsFoundWhereverItIs) {
  std::vector<double> values(10'000, -7.0);
  EXPECT_EQ(FirstBeyond(std::span<const double>(values), 7.0), std::nullopt);
  for (const double wrong : {7.1, -7.1, double(INFINITY), double(NAN)}) {
    for (const std::size_t at : {0, 1, 4095, 4096, 9999}) {
      std::vector<double> damaged = values;
      damaged[at] = wrong;
      damaged[9999] = wrong;
      EXPECT_EQ(FirstBeyond(std::span<const double>(damaged), 7.0), at) << wrong;
      const std::vector<float> single(damaged.begin(), damaged.end());
      EXPECT_EQ(FirstBeyond(std::span<const float>(single), 7.0), at) << wrong;
    }
  }
}

TEST(ValueRanges, AClipThatNobodyCouldHoldIsNotResampled) {
  EXPECT_THROW(Resample(WithRate(1e-9), 30.0), Error);
}

}  // namespace
}  // namespace holdfast
