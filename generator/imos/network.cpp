// SPDX-License-Identifier: MIT
#include "generator/imos/network.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

namespace holdfast::imos {
namespace {

constexpr const char* kWhere = "network";
constexpr double kPositionScale = 1e-3;     // scale of the positional encoding
constexpr double kAttentionEpsilon = 1e-6;  // of the LayerNorm in each layer

class ChainReader {
 public:
  ChainReader(const NetworkWeights& weights, std::string module)
      : tensors_(weights.tensors), module_(std::move(module)), width_(weights.config.block_width) {}

  // BatchNorm, one block.
  BlockChain Condition(int input, int output) const {
    BlockChain chain;
    chain.blocks = {ReadBlockOf("enc_rb0", input, output)};
    FoldInput(ReadNorm("enc_bn0", input), chain.blocks[0]);
    return chain;
  }

  // BatchNorm; a block; a block of [normalized input | its output]; mu and sigma stacked.
  BlockChain Encoder(int input, int first, int second, int latent) const {
    BlockChain chain;
    chain.blocks = {ReadBlockOf("enc_rb1_past", input, first),
                    ReadBlockOf("enc_rb2_past", input + first, second)};
    const Affine norm = ReadNorm("enc_bn1_past", input);
    for (Block& block : chain.blocks) FoldInput(norm, block);
    chain.head.resize(2 * latent, second);
    chain.head_bias.resize(2 * latent);
    int row = 0;
    for (const char* part : {"mu_past", "sigma_past"}) {
      const std::string name = module_ + part;
      chain.head.middleRows(row, latent) =
          nn::ReadMatrix(tensors_, name + ".weight", kWhere, latent, second).cast<double>();
      chain.head_bias.segment(row, latent) =
          nn::ReadVector(tensors_, name + ".bias", kWhere, latent).cast<double>();
      row += latent;
    }
    return chain;
  }

  // BatchNorm; a block; a block of [raw input | its output].
  BlockChain Decoder(int input, int first, int output) const {
    BlockChain chain;
    chain.blocks = {ReadBlockOf("dec_rb1", input, first),
                    ReadBlockOf("dec_rb2", input + first, output)};
    FoldInput(ReadNorm("dec_bn1", input), chain.blocks[0]);
    return chain;
  }

 private:
  Block ReadBlockOf(const char* name, int input, int output) const {
    return ReadBlock(tensors_, module_ + name, kWhere, input, width_, output);
  }
  Affine ReadNorm(const char* name, int size) const {
    return ReadBatchNorm(tensors_, module_ + name, kWhere, size);
  }

  const nn::TensorMap& tensors_;
  std::string module_;
  int width_;
};

}  // namespace

std::array<int, kNumArmJoints> ArmJoints(ArmOrder order) {
  if (order == ArmOrder::kAscending) return {16, 17, 18, 19, 20, 21};
  return {17, 19, 21, 16, 18, 20};
}

template <typename Real>
Network<Real>::Network(const NetworkWeights& weights, Isa isa) : config_(weights.config) {
  CheckNetwork(weights, kWhere);
  const auto make = [&](const BlockChain& chain) {
    return std::make_unique<const BlockNetwork<Real>>(chain, isa);
  };
  const Config& c = config_;
  if (c.has_arms) {
    const ChainReader arms(weights, "arms.");
    arms_condition_ = make(arms.Condition(c.ArmsConditionInput(), c.arms_condition));
    arms_encoder_ =
        make(arms.Encoder(c.ArmsPastInput(), c.arms_first, c.arms_second, c.arms_latent));
    arms_decoder_ = make(arms.Decoder(c.ArmsDecoderInput(), c.arms_decoder, kArmsSize));
  }
  const ChainReader body(weights, "body.");
  body_condition_ = make(body.Condition(c.BodyConditionInput(), c.body_condition));
  body_encoder_ = make(body.Encoder(c.BodyPastInput(), c.body_first, c.body_second, c.body_latent));
  body_decoder_ = make(body.Decoder(c.BodyDecoderInput(), c.body_decoder, c.BodyOutput()));
  if (c.self_attention) {
    attention_ = std::make_unique<const Attention<Real>>(weights.tensors, c, kWhere);
  }
}

Eigen::VectorXf ConditionOf(const Eigen::Ref<const Eigen::VectorXd>& betas, const Intent& intent,
                            const Eigen::Ref<const Eigen::MatrixXf>& action_table) {
  Eigen::VectorXf condition = Eigen::VectorXf::Zero(kNumBetas + kNumObjects + action_table.cols());
  const Eigen::Index known = std::min<Eigen::Index>(betas.size(), kNumBetas);
  condition.head(known) = betas.head(known).cast<float>();
  condition[kNumBetas + intent.object] = 1.0f;
  condition.tail(action_table.cols()) = action_table.row(intent.action).transpose();
  return condition;
}

template class Network<float>;
template class Network<double>;

Eigen::MatrixXd PositionalEncoding(int joints) {
  Eigen::MatrixXd encoding(kRotationSize, joints);
  for (int p = 0; p < joints; ++p) {
    for (int i = 0; i < kRotationSize; ++i) {
      const double angle = p / std::pow(10000.0, 2.0 * i / kRotationSize);
      encoding(i, p) = i % 2 == 0 ? std::sin(angle) : std::cos(angle);
    }
  }
  return encoding;
}

template <typename Real>
Attention<Real>::Attention(const nn::TensorMap& tensors, const Config& config,
                           const std::string& where)
    : position_((kPositionScale * PositionalEncoding(config.BodyJoints())).cast<Real>()) {
  const int heads = config.attention_heads, width = config.attention_width;
  const int joints = config.BodyJoints();
  for (int l = 0; l < config.attention_layers; ++l) {
    const std::string name = fmt::format("body.attention_model.attention_layers.{}.attn.", l);
    const auto read = [&](const char* part, int rows, int columns) -> Eigen::MatrixXd {
      return nn::ReadMatrix(tensors, name + part, where, rows, columns).template cast<double>();
    };
    const Eigen::MatrixXd query = read("w_qs.weight", heads * width, kRotationSize);
    const Eigen::MatrixXd key = read("w_ks.weight", heads * width, kRotationSize);
    const Eigen::MatrixXd value = read("w_vs.weight", heads * width, kRotationSize);
    const Eigen::MatrixXd combine = read("w_combine.weight", kRotationSize, heads * width);
    Layer& layer = layers_.emplace_back();
    for (int h = 0; h < heads; ++h) {
      const auto rows = [&](const Eigen::MatrixXd& of) { return of.middleRows(h * width, width); };
      layer.scores.push_back(
          (rows(query).transpose() * rows(key) / std::sqrt(double(width))).template cast<Real>());
      layer.values.push_back(
          (combine.middleCols(h * width, width) * rows(value)).template cast<Real>());
    }
    layer.gain = read("layer_norm.weight", joints, kRotationSize).transpose().template cast<Real>();
    layer.offset = read("layer_norm.bias", joints, kRotationSize).transpose().template cast<Real>();
  }
}

template <typename Real>
void Attention<Real>::Forward(const Real* pose, Real* out) const {
  const int joints = static_cast<int>(position_.cols());
  const Real share = Real(1) / static_cast<Real>(kRotationSize * joints);
  const Tokens x = Eigen::Map<const Tokens>(pose, kRotationSize, joints) + position_;
  Tokens q = x, projected(kRotationSize, joints), sum(kRotationSize, joints);
  Weights weights(joints, joints);
  for (const Layer& layer : layers_) {
    sum = q;
    for (std::size_t h = 0; h < layer.scores.size(); ++h) {
      projected.noalias() = layer.scores[h].lazyProduct(x);
      weights.noalias() = projected.transpose().lazyProduct(q);  // keys x queries: sums by column
      for (int i = 0; i < joints; ++i) {
        auto column = weights.col(i).array();
        column = (column - column.maxCoeff()).exp();
        column /= column.sum();
      }
      projected.noalias() = layer.values[h].lazyProduct(x);
      sum.noalias() += projected.lazyProduct(weights);
    }
    const Real mean = sum.sum() * share;
    const Real variance = (sum.array() - mean).square().sum() * share;
    const Real inverse_deviation = Real(1) / std::sqrt(variance + Real(kAttentionEpsilon));
    sum = (sum.array() - mean) * inverse_deviation;
    q = sum.cwiseProduct(layer.gain) + layer.offset;
  }
  Eigen::Map<Tokens>(out, kRotationSize, joints) = q;
}

template class Attention<float>;
template class Attention<double>;

}  // namespace holdfast::imos
