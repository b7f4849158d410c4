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

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramResult;

using ImportWeightsCommand = testing::ProgramTest;

const std::string kCheckpoints = HOLDFAST_SOURCE_DIR
    "/tests/fixtures/imos/arms.p " HOLDFAST_SOURCE_DIR "/tests/fixtures/imos/body.p ";

TEST_F(ImportWeightsCommand, WritesWeightsWithTheirTableOfActions) {
  NpzWriter table;
  table.AddFloat32("embeddings", {imos::kNumActions, 8},
                   std::vector<float>(imos::kNumActions * 8, 0.5f));
  table.Write(folder / "clip.npz");
  const nlohmann::json summary =
      folder.Json("import-weights " + kCheckpoints + "-o n.safetensors --actions clip.npz");
  EXPECT_EQ(summary["schema"], "holdfast/import-weights/1");
  EXPECT_EQ(summary["config"]["arm_order"], "17,19,21,16,18,20");
  EXPECT_EQ(summary["config"]["action_size"], "8");
  EXPECT_EQ(summary["has_action_table"], true);
  EXPECT_FALSE(summary["ignored"].empty());
  const imos::NetworkWeights weights = imos::ReadNetwork(folder / "n.safetensors");
  EXPECT_EQ(imos::ActionTable(weights)(28, 7), 0.5f);

  folder.Run("import-weights " + kCheckpoints + "-o n.safetensors", 1);
  const ProgramResult again = folder.Run("import-weights " + kCheckpoints +
                                         "-o n.safetensors --force --half --arm-order ascending");
  EXPECT_THAT(again.err, HasSubstr("without --actions"));
  EXPECT_THAT(again.out, HasSubstr("half precision"));
  EXPECT_EQ(imos::ReadNetwork(folder / "n.safetensors").config.arm_order,
            imos::ArmOrder::kAscending);
}

TEST_F(ImportWeightsCommand, ReadsTheCheckpointOfWandr) {
  const std::string fixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures/wandr/";
  const std::string files = fixtures + "wandr.ckpt --statistics " + fixtures + "statistics.npy ";
  const nlohmann::json summary = folder.Json("import-weights " + files + "-o n.safetensors");
  EXPECT_EQ(summary["latent_size"], 4);
  EXPECT_EQ(summary["ignored"], nlohmann::json::array({"body_model.v_template"}));
  folder.Run("reach --goal 0,-1,1 --weights n.safetensors --method intention -o walk");
  folder.Fails("import-weights " + fixtures + "wandr.ckpt -o o.safetensors", 2, "--statistics");
  folder.Fails("import-weights " + fixtures + "motions.npz --statistics " + fixtures +
                   "statistics.npy -o o.safetensors",
               1, "motions.npz: it has no tensor 'decoder");
}

TEST_F(ImportWeightsCommand, RefusesWhatIsNoCheckpointOfImos) {
  const std::string fixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures/";
  const std::string turned = fixtures + "imos/body.p " + fixtures + "imos/arms.p",
                    other = fixtures + "torch/views.pt " + fixtures + "imos/body.p";
  folder.Fails("import-weights " + turned + " -o n.safetensors", 1, "in that order");
  folder.Fails("import-weights " + other + " -o n.safetensors", 1, "views.pt");
  folder.Fails("import-weights " + kCheckpoints, 2, "--output");
}

}  // namespace
}  // namespace holdfast
