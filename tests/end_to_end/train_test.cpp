// SPDX-License-Identifier: MIT
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/wandr/network.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/atomic_file.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;
using testing::TemporaryFolder;

#ifdef HOLDFAST_HAS_TRAINING

class TrainCommand : public ::testing::Test {
 protected:
  TrainCommand() {
    std::filesystem::create_directories(folder_ / "corpus");
    for (const char* clip : {"demo_drink", "demo_inspect", "demo_pass"}) {
      const ProgramResult result = RunHoldfast(
          folder_.Path(), std::string("export ") + clip + " -o corpus/" + clip + ".npz");
      EXPECT_EQ(result.exit_code, 0) << result.err;
    }
  }
  ProgramResult Train(const std::string& arguments) const {
    return RunHoldfast(folder_.Path(),
                       "train wandr corpus --width 16 --blocks 1 --frames 64 --unroll 4 "
                       "--evaluate-every 4 --free-from 1 " +
                           arguments);
  }

  TemporaryFolder folder_;
};

TEST_F(TrainCommand, WritesWeightsThatReachTakes) {
  const ProgramResult result = Train("--iterations 8 -o out --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["schema"], "holdfast/train-wandr/1");
  EXPECT_EQ(summary["iterations"], 8);
  EXPECT_THAT(ReadText(folder_ / "out/train.html"), HasSubstr("<svg"));
  const wandr::NetworkWeights weights = wandr::ReadNetwork(folder_ / "out/best_half.safetensors");
  EXPECT_EQ(weights.layout, wandr::IntentionLayout::kBounded);
  EXPECT_THAT(weights.notes.at("corpus"), HasSubstr("h captured"));
  const ProgramResult reach = RunHoldfast(
      folder_.Path(),
      "reach --goal 0.3,-1,1 --samples 2 --no-report --weights out/best.safetensors -o r");
  EXPECT_EQ(reach.exit_code, 0) << reach.err;
}

TEST_F(TrainCommand, GoesOnWhereItWasStopped) {
  ASSERT_EQ(Train("--iterations 8 -o whole").exit_code, 0);
  // Stopped by a signal after its first evaluation, however slow the machine: what is there is
  // whole, and goes on.
  WriteAtomically(folder_ / "until_evaluated.sh",
                  "\"$@\" & pid=$!\n"
                  "while kill -0 $pid && ! test -e stopped/train.html; do\n"
                  "  sleep 0.1\n"
                  "done\n"
                  "kill -INT $pid; wait $pid\n");
  const ProgramResult stopped = RunHoldfast(
      folder_.Path(),
      "train wandr corpus --width 16 --blocks 1 --frames 64 --unroll 4 --evaluate-every 4 "
      "--free-from 1 --iterations 100000 -o stopped",
      "bash until_evaluated.sh");
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  const ProgramResult other = Train("--iterations 8 -o stopped");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("other options or data"));
  const ProgramResult again = Train("--iterations 8 -o whole");
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("resuming after iteration 8"));
}

TEST_F(TrainCommand, BadInputIsNamed) {
  const auto fails = [&](const std::string& arguments, int code, const std::string& message) {
    const ProgramResult result = RunHoldfast(folder_.Path(), "train " + arguments);
    EXPECT_EQ(result.exit_code, code) << arguments;
    EXPECT_THAT(result.err, HasSubstr(message)) << arguments;
  };
  fails("wandr nowhere -o out", 1, "nowhere");
  std::filesystem::create_directories(folder_ / "empty");
  fails("wandr empty -o out", 1, "none of 0 file(s)");
  fails("wandr corpus -o out --held-out empty", 1, "empty: holds no clip to validate with");
  WriteAtomically(folder_ / "empty/broken.npz", "PK\x03\x04 not a zip");
  fails("wandr empty -o out", 1, "broken.npz");
  fails("wandr corpus -o out --unroll 5", 2, "--unroll");
  fails("wandr corpus -o out --paper --width 64", 2, "--paper excludes --width");
  fails("wandr corpus -o out --from corpus/demo_drink.npz", 1, "demo_drink.npz");
  fails("imos corpus -o out", 1, "no object");
  fails("dance corpus -o out", 2, "dance");
}

#else

TEST(TrainCommand, SaysWhatIsMissing) {
  const TemporaryFolder folder;
  const ProgramResult result = RunHoldfast(folder.Path(), "train wandr corpus -o out");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("HOLDFAST_BUILD_TRAINING=ON"));
}

#endif

}  // namespace
}  // namespace holdfast
