// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/default_network.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

imos::Intent Intent(std::string_view action, std::string_view object) {
  return {imos::ActionId(action, "action"), imos::ObjectId(object, "object")};
}

TEST(Synthesize, MakesAMotionOfAHeldStartTheSameOnAnyThreads) {
  const ClipBody body{BodyModel::Default(), {}};
  const LoadedObject mug = LoadObject("mug");
  StandingHoldOptions holding;
  holding.left = true;
  const StandingHold hold = MakeStandingHold(body, mug, "drink", holding);
  ASSERT_EQ(hold.status, StandingHoldStatus::kMade);
  EXPECT_TRUE(hold.start.mirrored);
  SynthesizeOptions options;
  options.samples = 2;
  const SynthesizedMotion made =
      Synthesize(hold.start, imos::DefaultNetwork(), Intent("drink", "mug"), options);
  ASSERT_THAT(made.samples, SizeIs(2));
  EXPECT_LE(made.samples[0].faults, made.samples[1].faults);
  EXPECT_EQ(made.first_hand, Side::kLeft);
  EXPECT_EQ(made.motion.action, "drink");
  EXPECT_EQ(made.motion.holding_hand.back(), kHoldsLeft);  // out of the mirror
  options.threads = 3;
  const SynthesizedMotion again =
      Synthesize(hold.start, imos::DefaultNetwork(), Intent("drink", "mug"), options);
  EXPECT_EQ(again.motion.trans, made.motion.trans);
  EXPECT_EQ(again.motion.object->trans, made.motion.object->trans);
}

TEST(HoldingStart, OfAClipNeedsTheObjectInAHand) {
  const LoadedClip motion = LoadClip("demo_drink");
  const auto refused = [&](const Clip& clip, std::optional<int> frame) -> std::string {
    try {
      StartInClip(clip, motion.body, LoadObject("mug"), frame);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refused(motion.clip, 9999), HasSubstr("and no 9999"));
  EXPECT_THAT(refused(motion.clip, 3), HasSubstr("has no object track"));
}

}  // namespace
}  // namespace holdfast
