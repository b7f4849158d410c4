// SPDX-License-Identifier: MIT
// `holdfast import-weights` through the program.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/imos/weights.h"
#include "geometry/io/container/npz.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::RunHoldfast;
using testing::TemporaryFolder;

const std::string kCheckpoints = HOLDFAST_SOURCE_DIR
    "/tests/fixtures/imos/arms.p " HOLDFAST_SOURCE_DIR "/tests/fixtures/imos/body.p ";

TEST(ImportWeightsCommand, WritesWeightsWithTheirTableOfActions) {
  const TemporaryFolder folder;
  NpzWriter table;
  table.AddFloat32("embeddings", {imos::kNumActions, 8},
                   std::vector<float>(imos::kNumActions * 8, 0.5f));
  table.Write(folder.Path() / "clip.npz");
  const ProgramResult result =
      RunHoldfast(folder.Path(),
                  "import-weights " + kCheckpoints + "-o n.safetensors --actions clip.npz --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["schema"], "holdfast/import-weights/1");
  EXPECT_EQ(summary["config"]["arm_order"], "17,19,21,16,18,20");
  EXPECT_EQ(summary["config"]["action_size"], "8");
  EXPECT_EQ(summary["has_action_table"], true);
  EXPECT_FALSE(summary["ignored"].empty());
  const imos::NetworkWeights weights = imos::ReadNetwork(folder.Path() / "n.safetensors");
  EXPECT_EQ(imos::ActionTable(weights)(28, 7), 0.5f);

  EXPECT_EQ(
      RunHoldfast(folder.Path(), "import-weights " + kCheckpoints + "-o n.safetensors").exit_code,
      1)
      << "it is there already";
  const ProgramResult again =
      RunHoldfast(folder.Path(), "import-weights " + kCheckpoints +
                                     "-o n.safetensors --force --half --arm-order ascending");
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("without --actions"));
  EXPECT_THAT(again.out, HasSubstr("half precision"));
  EXPECT_EQ(imos::ReadNetwork(folder.Path() / "n.safetensors").config.arm_order,
            imos::ArmOrder::kAscending);
}

TEST(ImportWeightsCommand, RefusesWhatIsNoCheckpointOfImos) {
  const TemporaryFolder folder;
  const std::string fixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures/";
  const ProgramResult turned =
      RunHoldfast(folder.Path(), "import-weights " + fixtures + "imos/body.p " + fixtures +
                                     "imos/arms.p -o n.safetensors");
  EXPECT_EQ(turned.exit_code, 1);
  EXPECT_THAT(turned.err, HasSubstr("in that order"));
  const ProgramResult other =
      RunHoldfast(folder.Path(), "import-weights " + fixtures + "torch/views.pt " + fixtures +
                                     "imos/body.p -o n.safetensors");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("views.pt"));
  EXPECT_EQ(RunHoldfast(folder.Path(), "import-weights " + kCheckpoints).exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "n.safetensors"));
}

}  // namespace
}  // namespace holdfast
