// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/config.h"
#include "generator/imos/res_block.h"
#include "generator/imos/weights.h"
#include "generator/nn/tensor.h"

namespace holdfast::imos {

/// PE (6 x joints): PE[i, p] = sin(p / 10000^(2i/6)), PE[i+1, p] = cos(p / 10000^(2(i+1)/6)) for
/// joint p and i = 0, 2, 4.
Eigen::MatrixXd PositionalEncoding(int joints);

/// Self-attention over the joints of one pose, as published. Tokens are the joints' six numbers x
/// plus 1e-3 PE, X (6 x J). Each layer, with q = X in the first:
///   q <- LayerNorm(q + sum_h N_h X softmax(q^T M_h X)^T),
/// over all 6 J values with an affine map of that shape. Keys and values come from X in every
/// layer. The published products 6 -> heads x width -> 6 are combined to one 6 x 6 matrix per head:
/// M_h = Wq_h^T Wk_h / sqrt(width), N_h = Wc_h Wv_h; exact, with a third of the work.
template <typename Real>
class Attention {
 public:
  using Matrix6 = Eigen::Matrix<Real, kRotationSize, kRotationSize>;
  /// (6 x J) and (J x J) for at most 22 joints, without heap allocation.
  using Tokens =
      Eigen::Matrix<Real, kRotationSize, Eigen::Dynamic, 0, kRotationSize, kNumPoseJoints>;
  using Weights =
      Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, 0, kNumPoseJoints, kNumPoseJoints>;

  /// Reads body.attention_model.*. Throws Error as nn::ReadMatrix does.
  Attention(const nn::TensorMap& tensors, const Config& config, const std::string& where);

  /// `pose` and `out` have 6 J numbers, joint by joint.
  void Forward(const Real* pose, Real* out) const;

 private:
  struct Layer {
    std::vector<Matrix6> scores, values;  // M_h, N_h
    Tokens gain, offset;
  };

  Tokens position_;
  std::vector<Layer> layers_;
};

extern template class Attention<float>;
extern template class Attention<double>;

/// SMPL-X joints of the six arm slots, in the order of Arm Synthesis.
std::array<int, kNumArmJoints> ArmJoints(ArmOrder order);

/// A network prepared to run; immutable and safe to share between threads. Real is float; double is
/// for tests of float.
template <typename Real>
class Network {
 public:
  explicit Network(const NetworkWeights& weights, Isa isa = BestIsa());

  const Config& Options() const { return config_; }
  /// Size of the input of both modules' conditions: betas 10, object 54, action E.
  int ConditionSize() const { return kNumBetas + kNumObjects + config_.action_size; }

  /// Networks of the arms; must not be called with one module.
  const BlockNetwork<Real>& ArmsCondition() const { return *arms_condition_; }
  const BlockNetwork<Real>& ArmsEncoder() const { return *arms_encoder_; }  ///< -> mu, sigma
  const BlockNetwork<Real>& ArmsDecoder() const { return *arms_decoder_; }
  const BlockNetwork<Real>& BodyCondition() const { return *body_condition_; }
  const BlockNetwork<Real>& BodyEncoder() const { return *body_encoder_; }
  const BlockNetwork<Real>& BodyDecoder() const { return *body_decoder_; }
  /// Null without self-attention.
  const Attention<Real>* SelfAttention() const { return attention_.get(); }

 private:
  using Part = std::unique_ptr<const BlockNetwork<Real>>;

  Config config_;
  Part arms_condition_, arms_encoder_, arms_decoder_;
  Part body_condition_, body_encoder_, body_decoder_;
  std::unique_ptr<const Attention<Real>> attention_;
};

/// Returns one column of a rollout's conditions: betas (padded with zeros or truncated to 10), the
/// object's one-hot, the action's embedding (a row of `action_table`, 29 x E).
Eigen::VectorXf ConditionOf(const Eigen::Ref<const Eigen::VectorXd>& betas, const Intent& intent,
                            const Eigen::Ref<const Eigen::MatrixXf>& action_table);

extern template class Network<float>;
extern template class Network<double>;

}  // namespace holdfast::imos
