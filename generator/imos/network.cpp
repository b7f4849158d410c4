// SPDX-License-Identifier: MIT
#include "generator/imos/network.h"

#include <algorithm>
#include <string>

namespace holdfast::imos {
namespace {

constexpr const char* kWhere = "network";

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

  // BatchNorm; a block; a block of [normalised input | it]; mu and sigma below each other.
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

  // BatchNorm; a block; a block of [raw input | it].
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
Network<Real>::Network(const NetworkWeights& weights, bool differentiable, Isa isa)
    : config_(weights.config), differentiable_(differentiable) {
  CheckNetwork(weights, kWhere);
  const auto make = [&](const BlockChain& chain) {
    return std::make_unique<const BlockNetwork<Real>>(chain, differentiable, isa);
  };
  const Config& c = config_;
  if (c.HasArms()) {
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

template <typename Real>
long Network<Real>::NumProducts() const {
  long count = body_encoder_->NumProducts() + body_decoder_->NumProducts();
  if (config_.HasArms()) count += arms_encoder_->NumProducts() + arms_decoder_->NumProducts();
  return count;
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

}  // namespace holdfast::imos
