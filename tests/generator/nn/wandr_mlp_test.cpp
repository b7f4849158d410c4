// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "generator/nn/column_network.h"
#include "generator/nn/network_weights.h"
#include "geometry/error.h"
#include "tests/support/column_network_checks.h"
#include "tests/support/error_text.h"

namespace holdfast::nn {
namespace {

using testing::RunNetwork;
using testing::SupportedIsas;
using wandr::testing::RelativeError;

// A network whose normalizations do something, too.
MlpWeights Trained(int input, const std::vector<int>& hidden, int output, std::uint64_t seed) {
  MlpWeights mlp = RandomMlp(input, hidden, output, seed);
  RandomStream random(seed, 7);
  for (LayerWeights& layer : mlp.layers) {
    for (float& v : layer.gain) v = static_cast<float>(0.5 + random.Uniform());
    for (float& v : layer.offset) v = static_cast<float>(random.Uniform() - 0.5);
  }
  return mlp;
}

// The definition, layer by layer.
Eigen::MatrixXd Reference(const MlpWeights& mlp, Eigen::MatrixXd x) {
  for (std::size_t l = 0; l < mlp.layers.size(); ++l) {
    const LayerWeights& layer = mlp.layers[l];
    for (auto column : x.colwise()) {
      const Eigen::VectorXd centerd = column.array() - column.mean();
      const double variance = centerd.squaredNorm() / static_cast<double>(centerd.size());
      column = (centerd / std::sqrt(variance + 1e-5)).cwiseProduct(layer.gain.cast<double>()) +
               layer.offset.cast<double>();
    }
    x = (layer.weight.cast<double>() * x).colwise() + layer.bias.cast<double>();
    if (l + 1 < mlp.layers.size()) x = x.cwiseMax(0.0);
  }
  return x;
}

TEST(Mlp, IsItsDefinitionOnEveryInstructionSet) {
  std::srand(3);
  for (const std::vector<int>& hidden :
       {std::vector<int>{}, {5}, {16, 33}, {100, 64, 17}, {130, 200}}) {
    const MlpWeights weights = Trained(21, hidden, 35, 5);
    for (const int columns : {1, 2, 5, 6, 7, 13, 30}) {
      const Eigen::MatrixXd x = 3.0 * Eigen::MatrixXd::Random(21, columns);
      const Eigen::MatrixXd expected = Reference(weights, x);
      for (const Isa isa : SupportedIsas()) {
        SCOPED_TRACE(std::string(IsaName(isa)) + ", columns: " + std::to_string(columns));
        // Gains and offsets are folded in double and rounded to the network's own precision.
        EXPECT_LT(RelativeError(RunNetwork(Mlp<double>(weights, isa), x), expected), 1e-12);
        EXPECT_LT(RelativeError(RunNetwork(Mlp<float>(weights, isa), x), expected), 3e-5);
      }
    }
  }
}

TEST(Mlp, AColumnDoesNotDependOnItsNeighbors) {
  const MlpWeights weights = RandomMlp(341, TaperedWidths(341, 135), 135, 2);
  const Eigen::MatrixXd x = Eigen::MatrixXd::Random(341, 23);
  for (const Isa isa : SupportedIsas()) {
    SCOPED_TRACE(IsaName(isa));
    testing::CheckColumnsAreAlone(Mlp<float>(weights, isa), x);
  }
}

TEST(Mlp, PublishedSizes) {
  const std::vector<int> decoder = TaperedWidths(341, 135), encoder = TaperedWidths(412, 128);
  EXPECT_EQ(decoder,
            (std::vector<int>{512, 512, 512, 512, 512, 256, 256, 256, 256, 256, 256, 256, 256}));
  EXPECT_EQ(encoder,
            (std::vector<int>{512, 512, 512, 512, 512, 512, 512, 256, 256, 256, 256, 256, 256}));
  const auto parameters = [](const MlpWeights& mlp) {
    Eigen::Index count = 0;
    for (const LayerWeights& layer : mlp.layers) {
      count += 2 * layer.gain.size() + layer.weight.size() + layer.bias.size();
    }
    return count;
  };
  const MlpWeights mlp = RandomMlp(341, decoder, 135, 1);
  EXPECT_EQ(parameters(mlp), 1862193);
  EXPECT_EQ(parameters(RandomMlp(412, encoder, 128, 1)), 2291640);
}

TEST(Mlp, VectorJacobianProductIsTheDerivative) {
  const MlpWeights weights = Trained(19, {40, 64, 33}, 21, 8);
  for (const Isa isa : SupportedIsas()) {
    SCOPED_TRACE(IsaName(isa));
    testing::CheckBackward(Mlp<double>(weights, isa), [&](const Eigen::VectorXd& x) {
      return Reference(weights, x).col(0).eval();
    });
  }
}

TEST(Mlp, FloatGradientsAreThoseOfDouble) {
  const MlpWeights weights = RandomMlp(341, TaperedWidths(341, 135), 135, 4);
  // A unit within rounding of its kink may be on in one and off in the other.
  EXPECT_LT(testing::SingleGradientError(Mlp<float>(weights), Mlp<double>(weights)), 1e-3);
}

TEST(Mlp, LetsNotANumberThrough) {
  const Mlp<float> mlp(RandomMlp(20, {64, 64}, 20, 1));
  Eigen::MatrixXd x = Eigen::MatrixXd::Random(20, 2);
  x(4, 1) = std::numeric_limits<double>::quiet_NaN();
  const Eigen::MatrixXd y = RunNetwork(mlp, x);
  EXPECT_TRUE(y.col(0).allFinite());
  EXPECT_TRUE(y.col(1).array().isNaN().all());
}

TEST(MlpWeights, AreNamedAsInTheCheckpoint) {
  const MlpWeights mlp = Trained(21, {48, 32}, 10, 3);
  TensorMap tensors;
  AddTensors(mlp, "decoder", tensors);
  EXPECT_EQ(tensors.at("decoder.layers.1.weight").shape, (std::vector<std::size_t>{21}));
  EXPECT_EQ(tensors.at("decoder.layers.2.weight").shape, (std::vector<std::size_t>{48, 21}));
  EXPECT_EQ(tensors.at("decoder.layers.10.weight").shape, (std::vector<std::size_t>{10, 32}));
  // C order: a row of a weight is contiguous.
  EXPECT_EQ(tensors.at("decoder.layers.2.weight").values[22], mlp.layers[0].weight(1, 1));
  const MlpWeights back = MlpFromTensors(tensors, "decoder", "file");
  ASSERT_EQ(back.layers.size(), 3u);
  for (int l = 0; l < 3; ++l) {
    EXPECT_EQ(back.layers[l].weight, mlp.layers[l].weight);
    EXPECT_EQ(back.layers[l].bias, mlp.layers[l].bias);
    EXPECT_EQ(back.layers[l].gain, mlp.layers[l].gain);
    EXPECT_EQ(back.layers[l].offset, mlp.layers[l].offset);
  }
}

TEST(MlpWeights, RefuseWhatIsNoNetwork) {
  const MlpWeights mlp = RandomMlp(21, {48, 32}, 10, 3);
  TensorMap good;
  AddTensors(mlp, "decoder", good);
  const auto message = [](const TensorMap& tensors) {
    return holdfast::testing::ErrorText(
        [&] { MlpFromTensors(tensors, "decoder", "w.safetensors"); });
  };
  EXPECT_EQ(message(good), "no error");
  EXPECT_NE(message({}).find("decoder.layers.2.weight"), std::string::npos);
  TensorMap bad = good;
  bad.erase("decoder.layers.5.bias");
  EXPECT_NE(message(bad).find("'decoder.layers.5.bias'"), std::string::npos);
  bad = good;
  bad["decoder.layers.6.weight"] = {{32, 47}, std::vector<float>(32 * 47)};
  EXPECT_NE(message(bad).find("takes 47 values"), std::string::npos);
  bad = good;
  bad["decoder.layers.6.bias"].values[3] = NAN;
  EXPECT_NE(message(bad).find("not finite"), std::string::npos);
  bad = good;
  bad["decoder.layers.2.weight"].shape = {48, 22};
  EXPECT_NE(message(bad).find("dimension"), std::string::npos);
}

}  // namespace
}  // namespace holdfast::nn
