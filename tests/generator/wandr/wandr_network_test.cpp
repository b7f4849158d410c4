// SPDX-License-Identifier: MIT
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <variant>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/wandr_scene.h"

namespace holdfast::wandr {
namespace {

using holdfast::testing::TemporaryFolder;

std::string Message(const std::filesystem::path& path) {
  try {
    ReadNetwork(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

std::string Bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

const nn::MlpWeights& Chain(const nn::AnyWeights& weights) {
  return std::get<nn::MlpWeights>(weights);
}

const nn::ResidualWeights& Residual(const nn::AnyWeights& weights) {
  return std::get<nn::ResidualWeights>(weights);
}

TEST(Network, AFileHoldsAllOfIt) {
  const TemporaryFolder folder;
  for (const IntentionLayout layout :
       {IntentionLayout::kPaper, IntentionLayout::kFlagged, IntentionLayout::kBounded}) {
    NetworkWeights weights = testing::SmallNetwork(layout, 4);
    weights.notes["license"] = "CC0";
    const auto path = folder.Path() / "w.safetensors";
    WriteNetwork(weights, path);
    const NetworkWeights back = ReadNetwork(path);
    EXPECT_EQ(back.layout, layout);
    EXPECT_EQ(back.LatentSize(), 8);
    EXPECT_EQ(back.notes.at("license"), "CC0");
    ASSERT_TRUE(back.encoder.has_value());
    ASSERT_EQ(Chain(back.decoder).layers.size(), Chain(weights.decoder).layers.size());
    for (std::size_t l = 0; l < Chain(weights.decoder).layers.size(); ++l) {
      EXPECT_EQ(Chain(back.decoder).layers[l].weight, Chain(weights.decoder).layers[l].weight);
      EXPECT_EQ(Chain(*back.encoder).layers[l].bias, Chain(*weights.encoder).layers[l].bias);
    }
    EXPECT_LT((back.statistics.body_pose.mean - weights.statistics.body_pose.mean).norm(), 1e-6);
    EXPECT_EQ(back.statistics.body_orient_xy.deviation[3], 0.0);
    WriteNetwork(back, folder.Path() / "again.safetensors");
    EXPECT_EQ(Bytes(folder.Path() / "again.safetensors"), Bytes(path));
  }
}

TEST(Network, HalfPrecisionIsHalfTheSize) {
  const TemporaryFolder folder;
  const NetworkWeights weights = testing::SmallNetwork(IntentionLayout::kPaper, 4);
  WriteNetwork(weights, folder.Path() / "full.safetensors");
  WriteNetwork(weights, folder.Path() / "half.safetensors", true);
  EXPECT_LT(std::filesystem::file_size(folder.Path() / "half.safetensors"),
            0.65 * double(std::filesystem::file_size(folder.Path() / "full.safetensors")));
  const NetworkWeights back = ReadNetwork(folder.Path() / "half.safetensors");
  EXPECT_LT((Chain(back.decoder).layers[0].weight - Chain(weights.decoder).layers[0].weight)
                .cwiseAbs()
                .maxCoeff(),
            1e-4f);
}

TEST(Network, IsTheSameForTheSameSeed) {
  const NetworkWeights a = RandomNetwork(IntentionLayout::kPaper, 7),
                       b = RandomNetwork(IntentionLayout::kPaper, 7),
                       c = RandomNetwork(IntentionLayout::kPaper, 8);
  EXPECT_EQ(Chain(a.decoder).layers[3].weight, Chain(b.decoder).layers[3].weight);
  EXPECT_NE(Chain(a.decoder).layers[3].weight, Chain(c.decoder).layers[3].weight);
  EXPECT_EQ(nn::InputSize(a.decoder), 341);
  EXPECT_EQ(nn::InputSize(*a.encoder), 412);
  EXPECT_EQ(nn::OutputSize(*a.encoder), 128);
  EXPECT_LE(Chain(a.decoder).layers[0].weight.cwiseAbs().maxCoeff(), 1.0f / std::sqrt(341.0f));
}

TEST(Network, SaysWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "w.safetensors";
  const NetworkWeights good = testing::SmallNetwork(IntentionLayout::kPaper, 4);

  EXPECT_NE(Message(folder.Path() / "none.safetensors").find("none.safetensors"),
            std::string::npos);
  NetworkWeights bad = good;
  std::get<nn::MlpWeights>(bad.decoder).layers[1].weight(2, 3) = NAN;
  WriteNetwork(bad, path);
  EXPECT_NE(Message(path).find("'decoder.layers.6.weight' holds values that are not finite"),
            std::string::npos);
  bad = good;
  bad.layout = IntentionLayout::kBounded;  // 4 latents are left: the encoder does not fit
  WriteNetwork(bad, path);
  EXPECT_NE(Message(path).find("the encoder is"), std::string::npos);
  bad = good;
  bad.encoder.reset();
  bad.decoder = nn::RandomMlp(100, {20}, kStateSize, 1);
  WriteNetwork(bad, path);
  EXPECT_NE(Message(path).find("takes 100 values"), std::string::npos);
  bad.decoder = nn::RandomMlp(300, {20}, 134, 1);
  WriteNetwork(bad, path);
  EXPECT_NE(Message(path).find("gives 134 values"), std::string::npos);
  bad = good;
  bad.statistics.body_transl.deviation[1] = -1.0;
  WriteNetwork(bad, path);
  EXPECT_NE(Message(path).find("'statistics.body_transl.std' holds -1"), std::string::npos);

  SafetensorsWriter writer;
  writer.AddFloat32("decoder.layers.1.weight", {1}, std::vector<float>{1.0f});
  writer.SetMetadata({{"format", "wandr-9"}});
  writer.Write(path);
  EXPECT_NE(Message(path).find("'wandr-9'"), std::string::npos);
  writer.SetMetadata({{"intention", "other"}});
  writer.Write(path);
  EXPECT_NE(Message(path).find("'other'"), std::string::npos);
  writer.SetMetadata({});
  writer.Write(path);
  EXPECT_NE(Message(path).find("no tensor 'decoder.layers.2.weight'"), std::string::npos);
  SafetensorsWriter other;
  other.AddFloat32("weight", {1}, std::vector<float>{1.0f});
  other.Write(path);
  EXPECT_NE(Message(path).find("no tensor 'decoder.layers.*' and none 'decoder.input.*'"),
            std::string::npos);
}

TEST(Network, AFileOfAResidualNetworkHoldsAllOfIt) {
  const TemporaryFolder folder;
  const NetworkWeights weights = testing::SmallResidualNetwork(IntentionLayout::kBounded, 4);
  const auto path = folder.Path() / "w.safetensors";
  WriteNetwork(weights, path);
  const NetworkWeights back = ReadNetwork(path);
  EXPECT_EQ(back.layout, IntentionLayout::kBounded);
  EXPECT_EQ(back.LatentSize(), 8);
  ASSERT_TRUE(back.encoder.has_value());
  EXPECT_EQ(Residual(back.decoder).blocks[2].latent_weight,
            Residual(weights.decoder).blocks[2].latent_weight);
  EXPECT_EQ(Residual(back.encoder.value()).LatentSize(), 0);
  WriteNetwork(back, folder.Path() / "again.safetensors");
  EXPECT_EQ(Bytes(folder.Path() / "again.safetensors"), Bytes(path));

  // An encoder of the other kind is as good.
  NetworkWeights mixed = weights;
  mixed.encoder = testing::SmallNetwork(IntentionLayout::kBounded, 4).encoder;
  WriteNetwork(mixed, path);
  EXPECT_EQ(Chain(*ReadNetwork(path).encoder).layers[1].weight,
            Chain(*mixed.encoder).layers[1].weight);
}

TEST(Network, SaysWhatIsWrongWithAFileOfAResidualNetwork) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "w.safetensors";
  const NetworkWeights good = testing::SmallResidualNetwork(IntentionLayout::kPaper, 4);
  const auto message = [&](const auto& spoil) {
    NetworkWeights bad = good;
    spoil(bad, std::get<nn::ResidualWeights>(bad.decoder),
          std::get<nn::ResidualWeights>(*bad.encoder));
    WriteNetwork(bad, path);
    return Message(path);
  };
  using Weights = nn::ResidualWeights;
  const auto says = [&](const char* text, const auto& spoil) {
    EXPECT_NE(message(spoil).find(text), std::string::npos) << message(spoil);
  };
  EXPECT_EQ(message([](NetworkWeights&, Weights&, Weights&) {}), "accepted");
  says("'decoder.blocks.1.second.weight' holds values that are not finite",
       [](NetworkWeights&, Weights& decoder, Weights&) {
         decoder.blocks[1].second_weight(2, 3) = NAN;
       });
  says("the decoder's blocks take 3 latents, but the decoder has 8",
       [](NetworkWeights&, Weights& decoder, Weights&) {
         for (auto& block : decoder.blocks) block.latent_weight.setOnes(40, 3);
       });
  says("the decoder's blocks take 0 latents, but the decoder has 8",
       [](NetworkWeights&, Weights& decoder, Weights&) {
         for (auto& block : decoder.blocks) block.latent_weight.resize(40, 0);
       });
  says("the encoder's blocks take 2 latents", [](NetworkWeights&, Weights&, Weights& encoder) {
    for (auto& block : encoder.blocks) block.latent_weight.setOnes(40, 2);
  });
  says("the encoder is 412 -> 17", [](NetworkWeights&, Weights&, Weights& encoder) {
    encoder.output_weight.setOnes(17, 40);
    encoder.output_bias.setOnes(17);
  });
  says("the decoder gives 134 values", [](NetworkWeights&, Weights& decoder, Weights&) {
    decoder.output_weight.setOnes(134, 40);
    decoder.output_bias.setOnes(134);
  });
  says("more than the condition's 277", [](NetworkWeights& weights, Weights&, Weights&) {
    weights.decoder = nn::RandomResidual(270, 8, 16, 1, kStateSize, 1);
  });

  // A file put together from two.
  nn::TensorMap tensors;
  nn::AddTensors(good.decoder, "decoder", tensors);
  nn::AddTensors(testing::SmallNetwork(IntentionLayout::kPaper, 4).decoder, "decoder", tensors);
  SafetensorsWriter writer;
  for (const auto& [name, tensor] : tensors) writer.AddFloat32(name, tensor.shape, tensor.values);
  writer.Write(path);
  EXPECT_NE(Message(path).find("belongs to a chain of layers"), std::string::npos) << Message(path);
}

}  // namespace
}  // namespace holdfast::wandr
