// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <span>

#include <Eigen/Core>

#include "generator/imos/attention.h"
#include "generator/imos/config.h"
#include "generator/imos/res_block.h"
#include "generator/imos/weights.h"

namespace holdfast::imos {

/// SMPL-X joints of the arms' six slots, in the order of Arm Synthesis.
std::array<int, kNumArmJoints> ArmJoints(ArmOrder order);

/// A network ready to run: const, shared by threads. Real is float; double is for tests of
/// derivatives and of float.
///
/// Without `differentiable` nothing can be run backwards, and half the memory is needed.
template <typename Real>
class Network {
 public:
  explicit Network(const NetworkWeights& weights, bool differentiable = false, Isa isa = BestIsa());

  const Config& Options() const { return config_; }
  bool IsDifferentiable() const { return differentiable_; }
  /// betas 10, object 54, action E: what both modules' conditions are made of.
  int ConditionSize() const { return kNumBetas + kNumObjects + config_.action_size; }

  /// Of the arms; must not be called where one module does everything.
  const BlockNetwork<Real>& ArmsCondition() const { return *arms_condition_; }
  const BlockNetwork<Real>& ArmsEncoder() const { return *arms_encoder_; }  ///< -> mu, sigma
  const BlockNetwork<Real>& ArmsDecoder() const { return *arms_decoder_; }
  const BlockNetwork<Real>& BodyCondition() const { return *body_condition_; }
  const BlockNetwork<Real>& BodyEncoder() const { return *body_encoder_; }
  const BlockNetwork<Real>& BodyDecoder() const { return *body_decoder_; }
  /// Null without self-attention.
  const Attention<Real>* SelfAttention() const { return attention_.get(); }

  /// Multiply-adds of one step of one sample, attention aside.
  long NumProducts() const;

 private:
  using Part = std::unique_ptr<const BlockNetwork<Real>>;

  Config config_;
  bool differentiable_;
  Part arms_condition_, arms_encoder_, arms_decoder_;
  Part body_condition_, body_encoder_, body_decoder_;
  std::unique_ptr<const Attention<Real>> attention_;
};

/// One column of a rollout's conditions: betas (those missing are zero, those beyond 10 are left
/// out), the object's one-hot, the action's embedding: a row of `action_table` (29 x E).
Eigen::VectorXf ConditionOf(const Eigen::Ref<const Eigen::VectorXd>& betas, const Intent& intent,
                            const Eigen::Ref<const Eigen::MatrixXf>& action_table);

extern template class Network<float>;
extern template class Network<double>;

}  // namespace holdfast::imos
