// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <torch/torch.h>

#include "generator/imos/config.h"
#include "generator/nn/tensor.h"

namespace holdfast::imos {

/// How the networks compute, and what batch norms see. As they run: running statistics, no dropout.
struct Pass {
  /// Batch norms take the batch's own statistics, and `running` follows them.
  bool batch_statistics = false;
  double dropout = 0.0;
  at::Generator* generator = nullptr;  ///< of dropout; not null where there is any

  struct Statistics {
    torch::Tensor mean, variance;
  };
  /// The networks' running statistics as this pass has moved them, by the norm's name: the networks
  /// stay as they are, so that several passes may be under way at once.
  std::map<std::string, Statistics, std::less<>> running;
};

/// What somebody is to do: one row each.
struct ConditionInput {
  torch::Tensor betas;   ///< (B x 10)
  torch::Tensor object;  ///< (B x 54) one-hot
  torch::Tensor action;  ///< (B) ids
};

struct Latents {
  torch::Tensor mu, sigma;  ///< (B x latent); sigma is a linear output, of any sign

  torch::Tensor Sample(const torch::Tensor& noise) const { return mu + sigma * noise; }
  /// Divergence from N(0, 1), the mean over rows and dimensions:
  /// -1/2 mean(1 + log sigma^2 - mu^2 - sigma^2).
  torch::Tensor Divergence() const;
};

/// The networks of IMoS in LibTorch, to be trained: parameters and running statistics by the names
/// of weights files (config.h). Rows are samples. Inputs are put together as config.h says; what
/// comes out is what imos::Network computes of the same weights.
class TorchNetworks {
 public:
  /// `tensors`: those of TensorsOf(config, true). Throws Error for one that is missing or of
  /// another shape.
  TorchNetworks(const Config& config, const nn::TensorMap& tensors, const std::string& where);

  const Config& Sizes() const { return config_; }

  /// phi of the arms (B x arms_condition) and of the body (B x body_condition).
  torch::Tensor ArmsCondition(const ConditionInput& input, Pass& pass) const;
  torch::Tensor BodyCondition(const ConditionInput& input, Pass& pass) const;

  /// arms_now | object | phi
  Latents ArmsPresent(const torch::Tensor& input, Pass& pass) const;
  /// `past`: past arms | past objects
  Latents ArmsPast(const torch::Tensor& past, const torch::Tensor& phi, Pass& pass) const;
  /// Step of the arms (B x 36) from the key frame before.
  torch::Tensor ArmsDecode(const torch::Tensor& latent, const torch::Tensor& past,
                           const torch::Tensor& phi, Pass& pass) const;

  /// A past pose (B x BodyPoseSize()) attended to by itself.
  torch::Tensor Attend(const torch::Tensor& pose, Pass& pass) const;
  /// `input`: the whole of the past encoder's.
  Latents BodyPast(const torch::Tensor& input, Pass& pass) const;
  /// Pose, and step of the root where it is predicted (B x BodyOutput()).
  torch::Tensor BodyDecode(const torch::Tensor& latent, const torch::Tensor& input,
                           Pass& pass) const;

  /// In the order of their names: all, or those of one module (a prefix "arms." or "body."; the
  /// embedding belongs to both). An embedding that is not learned is none.
  std::vector<torch::Tensor> Parameters(const std::string& prefix = "") const;
  long NumParameters() const;
  /// Running statistics become the passes' mean; those that no pass moved stay.
  void TakeStatistics(std::span<const Pass* const> passes);

  nn::TensorMap Tensors() const;
  /// Every parameter and statistic, by name.
  std::map<std::string, torch::Tensor, std::less<>>& Named() { return tensors_; }
  const std::map<std::string, torch::Tensor, std::less<>>& Named() const { return tensors_; }

 private:
  const torch::Tensor& At(const std::string& name) const;
  torch::Tensor Linear(const torch::Tensor& x, const std::string& name) const;
  torch::Tensor BatchNorm(const torch::Tensor& x, const std::string& name, Pass& pass) const;
  torch::Tensor Block(const torch::Tensor& x, const std::string& name, Pass& pass) const;
  torch::Tensor Condition(const ConditionInput& input, bool with_object, const std::string& module,
                          Pass& pass) const;
  Latents Encode(const torch::Tensor& input, const std::string& module, const std::string& suffix,
                 const std::string& latent, Pass& pass) const;

  Config config_;
  std::map<std::string, torch::Tensor, std::less<>> tensors_;
  torch::Tensor positions_;  // (joints x 6), 1e-3 of the sinusoids
};

/// Tensors to begin with, those for training too. As published: RandomNetwork's. Ours: linear
/// layers U(-1/sqrt(in), 1/sqrt(in)), batch norms the identity, the decoders' last blocks a tenth
/// of that, so that the arms begin with small steps. `embeddings` (29 x E), where it is not empty,
/// is the table of actions; else N(0, 1).
nn::TensorMap StartingTensors(const Config& config, bool as_published, std::uint64_t seed,
                              const Eigen::MatrixXf& embeddings = {});

}  // namespace holdfast::imos
