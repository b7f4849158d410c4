// SPDX-License-Identifier: MIT
#include "generator/imos/synthesis_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(SynthesisNetwork, KnowsWhatItWasTrainedOn) {
  const testing::TemporaryFolder folder;
  const std::string file = (folder / "networks.safetensors").string();
  imos::NetworkWeights weights = imos::RandomNetwork(imos::CompactConfig(), 3);
  imos::WriteNetwork(weights, file);
  const SynthesisNetwork silent = LoadSynthesisNetwork(file);
  EXPECT_EQ(silent.Actions().size(), imos::Actions().size());
  EXPECT_EQ(silent.SecondsPerKeyFrame(0), 0.1);

  weights.notes["seconds_per_key_frame"] = R"({"drink": 0.2, "pass": 0.4})";
  weights.notes["seen"] = R"({"drink": {"mug": 3}})";
  imos::WriteNetwork(weights, file);
  const SynthesisNetwork network = LoadSynthesisNetwork(file);
  EXPECT_EQ(network.source, file);
  EXPECT_EQ(network.checksum, Checksum(ByteSource(std::filesystem::path(file))));
  EXPECT_NE(network.checksum, silent.checksum);
  EXPECT_EQ(network.action_table, imos::ActionTable(weights));
  EXPECT_THAT(network.Actions(), ElementsAre("drink"));
  EXPECT_EQ(network.SecondsPerKeyFrame(imos::ActionId("drink", "action")), 0.2);
  EXPECT_NEAR(network.SecondsPerKeyFrame(imos::ActionId("call", "action")), 0.3, 1e-12);

  weights.notes["seen"] = "mugs";
  imos::WriteNetwork(weights, file);
  EXPECT_THAT(testing::ErrorText([&] { LoadSynthesisNetwork(file); }),
              HasSubstr("its note 'seen' is not a JSON object"));
}

}  // namespace
}  // namespace holdfast
