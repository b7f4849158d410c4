// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "generator/nn/mlp.h"
#include "generator/nn/mlp_weights.h"
#include "geometry/error.h"
#include "tests/support/wandr_scene.h"

namespace holdfast::nn {
namespace {

using wandr::testing::NumericGradient;
using wandr::testing::RelativeError;

// A network whose normalisations do something, too.
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
      const Eigen::VectorXd centred = column.array() - column.mean();
      const double variance = centred.squaredNorm() / static_cast<double>(centred.size());
      column = (centred / std::sqrt(variance + 1e-5)).cwiseProduct(layer.gain.cast<double>()) +
               layer.offset.cast<double>();
    }
    x = (layer.weight.cast<double>() * x).colwise() + layer.bias.cast<double>();
    if (l + 1 < mlp.layers.size()) x = x.cwiseMax(0.0);
  }
  return x;
}

template <typename Real>
Eigen::MatrixXd RunMlp(const Mlp<Real>& mlp, const Eigen::MatrixXd& x) {
  Tape<Real> tape(mlp, static_cast<int>(x.cols()));
  tape.Input() = x.cast<Real>();
  mlp.Forward(tape);
  return tape.Output().template cast<double>();
}

std::vector<Isa> SupportedIsas() {
  std::vector<Isa> all;
  for (const Isa isa : {Isa::kScalar, Isa::kSse2, Isa::kAvx2, Isa::kAvx512}) {
    if (IsSupported(isa)) all.push_back(isa);
  }
  return all;
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
        EXPECT_LT(RelativeError(RunMlp(Mlp<double>(weights, isa), x), expected), 1e-12);
        EXPECT_LT(RelativeError(RunMlp(Mlp<float>(weights, isa), x), expected), 3e-5);
      }
    }
  }
}

TEST(Mlp, AColumnDoesNotDependOnItsNeighbours) {
  const MlpWeights weights = RandomMlp(341, TaperedWidths(341, 135), 135, 2);
  const Eigen::MatrixXd x = Eigen::MatrixXd::Random(341, 23);
  for (const Isa isa : SupportedIsas()) {
    const Mlp<float> mlp(weights, isa);
    const Eigen::MatrixXd all = RunMlp(mlp, x);
    for (const int size : {1, 2, 4, 9}) {
      for (int first = 0; first + size <= 23; first += size) {
        EXPECT_EQ(RunMlp(mlp, x.middleCols(first, size)), all.middleCols(first, size))
            << IsaName(isa) << ", " << size << " of 23 columns";
      }
    }
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
  EXPECT_EQ(Mlp<float>(mlp).NumProducts(), 1847552);
}

TEST(Mlp, VectorJacobianProductIsTheDerivative) {
  const MlpWeights weights = Trained(19, {40, 64, 33}, 21, 8);
  for (const Isa isa : SupportedIsas()) {
    const Mlp<double> mlp(weights, isa);
    const Eigen::MatrixXd x = Eigen::MatrixXd::Random(19, 3);
    const Eigen::MatrixXd rows = Eigen::MatrixXd::Random(21, 6);  // two rows for each column
    Tape<double> tape(mlp, 3);
    tape.Input() = x;
    mlp.Forward(tape);
    Scratch<double> scratch(mlp, 6);
    Eigen::MatrixXd found = Eigen::MatrixXd::Constant(19, 6, NAN);
    mlp.Backward(tape, rows, found, scratch);
    for (int c = 0; c < 6; ++c) {
      const auto value = [&](const Eigen::VectorXd& step) {
        return rows.col(c).dot(Reference(weights, x.col(c / 2) + step).col(0));
      };
      EXPECT_LT(RelativeError(found.col(c), NumericGradient(value, 19)), 1e-7) << IsaName(isa);
    }
  }
}

TEST(Mlp, FloatGradientsAreThoseOfDouble) {
  const MlpWeights weights = RandomMlp(341, TaperedWidths(341, 135), 135, 4);
  const Mlp<float> single(weights);
  const Mlp<double> reference(weights);
  const Eigen::MatrixXf x = Eigen::MatrixXf::Random(341, 9),
                        y_bar = Eigen::MatrixXf::Random(135, 9);
  Tape<float> tape(single, 9);
  tape.Input() = x;
  single.Forward(tape);
  Tape<double> exact(reference, 9);
  exact.Input() = x.cast<double>();
  reference.Forward(exact);
  Eigen::MatrixXf x_bar(341, 9);
  Eigen::MatrixXd expected(341, 9);
  Scratch<float> scratch(single, 9);
  Scratch<double> exact_scratch(reference, 9);
  single.Backward(tape, y_bar, x_bar, scratch);
  reference.Backward(exact, y_bar.cast<double>(), expected, exact_scratch);
  // A unit within rounding of its kink may be on in one and off in the other.
  EXPECT_LT((x_bar.cast<double>() - expected).norm() / expected.norm(), 1e-3);
}

TEST(Mlp, LetsNotANumberThrough) {
  const Mlp<float> mlp(RandomMlp(20, {64, 64}, 20, 1));
  Eigen::MatrixXd x = Eigen::MatrixXd::Random(20, 2);
  x(4, 1) = std::numeric_limits<double>::quiet_NaN();
  const Eigen::MatrixXd y = RunMlp(mlp, x);
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
  const auto message = [](const TensorMap& tensors) -> std::string {
    try {
      MlpFromTensors(tensors, "decoder", "w.safetensors");
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message(good), "accepted");
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
