// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "generator/nn/column_network.h"
#include "geometry/error.h"
#include "tests/support/column_network_checks.h"
#include "tests/support/error_text.h"

namespace holdfast::nn {
namespace {

using testing::RunNetwork;
using testing::SupportedIsas;
using wandr::testing::RelativeError;

// A network whose normalizations do something, too.
ResidualWeights Trained(int input, int latent, int width, int blocks, int output) {
  ResidualWeights network = RandomResidual(input, latent, width, blocks, output, 5);
  RandomStream random(5, 7);
  const auto draw = [&](Eigen::VectorXf& gain, Eigen::VectorXf& offset) {
    for (float& v : gain) v = static_cast<float>(0.5 + random.Uniform());
    for (float& v : offset) v = static_cast<float>(random.Uniform() - 0.5);
  };
  for (ResidualWeights::Block& block : network.blocks) draw(block.gain, block.offset);
  draw(network.output_gain, network.output_offset);
  return network;
}

// The definition, column by column.
Eigen::VectorXd Normed(const Eigen::VectorXd& h, const Eigen::VectorXf& gain,
                       const Eigen::VectorXf& offset) {
  const Eigen::VectorXd centerd = h.array() - h.mean();
  const double variance = centerd.squaredNorm() / static_cast<double>(h.size());
  return (centerd / std::sqrt(variance + 1e-5)).cwiseProduct(gain.cast<double>()) +
         offset.cast<double>();
}

Eigen::MatrixXd Reference(const ResidualWeights& network, const Eigen::MatrixXd& x) {
  Eigen::MatrixXd y(network.OutputSize(), x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    const Eigen::VectorXd z = x.col(j).head(network.LatentSize());
    Eigen::VectorXd h =
        network.input_weight.cast<double>() * x.col(j) + network.input_bias.cast<double>();
    for (const ResidualWeights::Block& block : network.blocks) {
      const Eigen::VectorXd a =
          block.first_weight.cast<double>() * Normed(h, block.gain, block.offset) +
          block.latent_weight.cast<double>() * z + block.first_bias.cast<double>();
      const Eigen::VectorXd silu = a.unaryExpr([](double v) { return v / (1.0 + std::exp(-v)); });
      h += block.second_weight.cast<double>() * silu + block.second_bias.cast<double>();
    }
    y.col(j) = network.output_weight.cast<double>() *
                   Normed(h, network.output_gain, network.output_offset) +
               network.output_bias.cast<double>();
  }
  return y;
}

struct Sizes {
  int input, latent, width, blocks, output;
};

TEST(ResidualMlp, IsItsDefinitionOnEveryInstructionSet) {
  std::srand(3);
  for (const Sizes s : {Sizes{21, 4, 33, 1, 35}, {21, 0, 64, 3, 17}, {50, 50, 130, 2, 70}}) {
    const ResidualWeights weights = Trained(s.input, s.latent, s.width, s.blocks, s.output);
    for (const int columns : {1, 2, 5, 6, 7, 13, 30}) {
      const Eigen::MatrixXd x = 3.0 * Eigen::MatrixXd::Random(s.input, columns);
      const Eigen::MatrixXd expected = Reference(weights, x);
      for (const Isa isa : SupportedIsas()) {
        SCOPED_TRACE(std::string(IsaName(isa)) + ", columns: " + std::to_string(columns));
        EXPECT_LT(RelativeError(RunNetwork(ResidualMlp<double>(weights, isa), x), expected), 1e-13);
        EXPECT_LT(RelativeError(RunNetwork(ResidualMlp<float>(weights, isa), x), expected), 5e-6);
      }
    }
  }
}

TEST(ResidualMlp, AColumnDoesNotDependOnItsNeighbors) {
  const ResidualWeights weights = RandomResidual(341, 64, 200, 3, 135, 2);
  Eigen::MatrixXd x = Eigen::MatrixXd::Random(341, 23);
  x.col(4).head(64).setZero();  // as latents switched off
  for (const Isa isa : SupportedIsas()) {
    SCOPED_TRACE(IsaName(isa));
    testing::CheckColumnsAreAlone(ResidualMlp<float>(weights, isa), x);
  }
}

TEST(ResidualMlp, VectorJacobianProductIsTheDerivative) {
  for (const Sizes s : {Sizes{19, 7, 40, 3, 21}, {19, 0, 33, 1, 21}}) {
    const ResidualWeights weights = Trained(s.input, s.latent, s.width, s.blocks, s.output);
    for (const Isa isa : SupportedIsas()) {
      SCOPED_TRACE(IsaName(isa));
      testing::CheckBackward(ResidualMlp<double>(weights, isa), [&](const Eigen::VectorXd& x) {
        return Reference(weights, x).col(0).eval();
      });
    }
  }
}

TEST(ResidualMlp, FloatGradientsAreThoseOfDouble) {
  const ResidualWeights weights = RandomResidual(341, 64, 256, 4, 135, 4);
  EXPECT_LT(testing::SingleGradientError(ResidualMlp<float>(weights), ResidualMlp<double>(weights)),
            1e-5);
}

// The loop itself, over all it may be given.
template <typename Real>
void CheckSilu(Isa isa, double reach, double tolerance) {
  constexpr int kCount = 4096;
  AlignedArray<Real> x(kCount), y(kCount), gradient(kCount, Real(1));
  for (int i = 0; i < kCount; ++i) {
    const double s = 2.0 * i / (kCount - 1) - 1.0;  // many near zero, and out to +-reach
    x[i] = static_cast<Real>(reach * s * s * s * s * s);
  }
  const kernels::LayerLoops<Real>& loops = LoopsFor<Real>(isa);
  loops.silu({x.data(), kCount, kCount, 1, y.data(), kCount});
  loops.silu_backward({gradient.data(), kCount, x.data(), kCount, kCount, 1, 1});
  for (int i = 0; i < kCount; ++i) {
    const double a = x[i], sigmoid = 1.0 / (1.0 + std::exp(-a));
    EXPECT_NEAR(y[i], a * sigmoid, tolerance * (std::abs(a * sigmoid) + 1e-30)) << a;
    EXPECT_NEAR(gradient[i], sigmoid * (1.0 + a * (1.0 - sigmoid)), 4.0 * tolerance) << a;
  }
}

TEST(Silu, IsExactToRounding) {
  for (const Isa isa : SupportedIsas()) {
    SCOPED_TRACE(IsaName(isa));
    CheckSilu<float>(isa, 80.0, 4e-7);
    CheckSilu<double>(isa, 600.0, 1e-15);
  }
}

TEST(Silu, HasItsLimits) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const Isa isa : SupportedIsas()) {
    AlignedArray<float> x(16, 0.0f), y(16);
    x[0] = 3e38f;
    x[1] = -1e6f;
    x[2] = kInfinity;
    x[3] = std::numeric_limits<float>::quiet_NaN();
    LoopsFor<float>(isa).silu({x.data(), 16, 16, 1, y.data(), 16});
    EXPECT_EQ(y[0], 3e38f);
    EXPECT_LE(std::abs(y[1]), 1e-30f);
    EXPECT_EQ(y[2], kInfinity);
    EXPECT_TRUE(std::isnan(y[3]));
    EXPECT_EQ(y[4], 0.0f);
  }
}

TEST(ResidualMlp, LetsNotANumberThrough) {
  const ResidualMlp<float> network(RandomResidual(20, 4, 64, 2, 20, 1));
  Eigen::MatrixXd x = Eigen::MatrixXd::Random(20, 2);
  x(2, 1) = std::numeric_limits<double>::quiet_NaN();
  const Eigen::MatrixXd y = RunNetwork(network, x);
  EXPECT_TRUE(y.col(0).allFinite());
  EXPECT_TRUE(y.col(1).array().isNaN().all());
}

TEST(ResidualWeights, AreNamedAsDocumented) {
  const ResidualWeights network = Trained(21, 5, 32, 12, 10);
  TensorMap tensors;
  AddTensors(network, "decoder", tensors);
  EXPECT_EQ(tensors.size(), 2u + 12u * 7u + 4u);
  EXPECT_EQ(tensors.at("decoder.input.weight").shape, (std::vector<std::size_t>{32, 21}));
  EXPECT_EQ(tensors.at("decoder.blocks.11.latent.weight").shape, (std::vector<std::size_t>{32, 5}));
  EXPECT_EQ(tensors.at("decoder.output_norm.bias").shape, (std::vector<std::size_t>{32}));
  // C order: a row of a weight is contiguous.
  EXPECT_EQ(tensors.at("decoder.output.weight").values[33], network.output_weight(1, 1));
  const ResidualWeights back = ResidualFromTensors(tensors, "decoder", "file");
  ASSERT_EQ(back.blocks.size(), 12u);
  const Eigen::MatrixXd x = Eigen::MatrixXd::Random(21, 3);
  EXPECT_EQ(Reference(back, x), Reference(network, x)) << "every part is where it was";
}

TEST(ResidualWeights, RefuseWhatIsNoNetwork) {
  TensorMap good;
  AddTensors(RandomResidual(21, 5, 32, 3, 10, 3), "decoder", good);
  const auto message = [](const TensorMap& tensors) {
    return holdfast::testing::ErrorText(
        [&] { AnyFromTensors(tensors, "decoder", "w.safetensors"); });
  };
  const auto spoilt = [&](const auto& spoil) {
    TensorMap bad = good;
    spoil(bad);
    return message(bad);
  };
  EXPECT_EQ(message(good), "no error");
  for (const auto& [name, tensor] : good) {
    TensorMap bad = good;
    bad.erase(name);
    // Without the latents of the first block those of the next are not expected.
    if (name == "decoder.blocks.0.latent.weight") {
      EXPECT_NE(message(bad).find("no tensor 'decoder.blocks.1.latent.weight'"), std::string::npos);
    } else {
      EXPECT_NE(message(bad).find("there is no tensor '" + name + "'"), std::string::npos)
          << message(bad);
    }
    bad = good;
    bad[name].values.back() = NAN;
    EXPECT_NE(message(bad).find("'" + name + "' holds values that are not finite"),
              std::string::npos);
    bad = good;
    bad[name].shape.insert(bad[name].shape.begin(), 1);
    EXPECT_NE(message(bad).find("'" + name + "' does not have"), std::string::npos);
  }
  EXPECT_NE(spoilt([](TensorMap& bad) {
              bad["decoder.blocks.1.first.weight"] = {{32, 31}, std::vector<float>(32 * 31)};
            }).find("'decoder.blocks.1.first.weight' is 32 x 31, 32 x 32 is needed"),
            std::string::npos);
  EXPECT_NE(spoilt([](TensorMap& bad) {
              bad["decoder.output.weight"] = {{10, 31}, std::vector<float>(10 * 31)};
            }).find("takes 31 values, the network's width is 32"),
            std::string::npos);
  EXPECT_NE(spoilt([](TensorMap& bad) {
              bad["decoder.blocks.0.latent.weight"] = {{32, 22}, std::vector<float>(32 * 22)};
            }).find("takes 22 values, the whole input has 21"),
            std::string::npos);
  for (const char* unknown : {"decoder.blocks.1.third.bias", "decoder.blocks.-1.norm.bias",
                              "decoder.blocks.99999999999.norm.bias", "decoder.input.scale"}) {
    EXPECT_NE(spoilt([&](TensorMap& bad) {
                bad[unknown] = {{1}, {1.0f}};
              }).find("has no tensor '" + std::string(unknown) + "'"),
              std::string::npos)
        << unknown;
  }
  EXPECT_NE(spoilt([](TensorMap& bad) {
              bad["decoder.layers.1.bias"] = {{1}, {1.0f}};
            }).find("belongs to a chain of layers"),
            std::string::npos);
}

}  // namespace
}  // namespace holdfast::nn
