// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_networks.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "generator/imos/res_block.h"
#include "generator/imos/weights.h"
#include "generator/nn/random_stream.h"
#include "generator/training/network_tensors.h"
#include "geometry/error.h"

namespace holdfast::imos {
namespace {

constexpr double kLayerNormEpsilon = 1e-6;
constexpr double kMomentum = 0.1;  // of running statistics
constexpr float kSmallStart = 0.1f;
constexpr const char* kEmbedding = "action_embedding.weight";

torch::Tensor LeakyRelu(const torch::Tensor& x) { return torch::leaky_relu(x, kLeakySlope); }

torch::Tensor Dropped(const torch::Tensor& x, const Pass& pass) {
  if (pass.dropout == 0.0) return x;
  const double kept = 1.0 - pass.dropout;
  return x * torch::empty_like(x).bernoulli_(kept, *pass.generator).div_(kept);
}

torch::Tensor Positions(int joints) {
  torch::Tensor positions = torch::empty({joints, kRotationSize});
  auto at = positions.accessor<float, 2>();
  for (int p = 0; p < joints; ++p) {
    for (int i = 0; i < kRotationSize; i += 2) {
      at[p][i] = static_cast<float>(1e-3 * std::sin(p / std::pow(1e4, 2.0 * i / kRotationSize)));
      at[p][i + 1] =
          static_cast<float>(1e-3 * std::cos(p / std::pow(1e4, 2.0 * (i + 1) / kRotationSize)));
    }
  }
  return positions;
}

bool IsStatistic(const std::string& name) {
  return name.ends_with(".running_mean") || name.ends_with(".running_var");
}

bool IsNorm(const std::string& name) {
  const std::size_t end = name.rfind('.'), begin = name.rfind('.', end - 1) + 1;
  const std::string layer = name.substr(begin, end - begin);
  return layer.find("bn") != std::string::npos || layer == "layer_norm";
}

}  // namespace

torch::Tensor Latents::Divergence() const {
  const torch::Tensor square = sigma * sigma;
  return -0.5 * (1.0 + torch::log(square + 1e-12) - mu * mu - square).mean();
}

TorchNetworks::TorchNetworks(const Config& config, const nn::TensorMap& tensors,
                             const std::string& where)
    : config_(config), positions_(Positions(config.BodyJoints())) {
  std::vector<TensorShape> all = TensorsOf(config, true);
  if (std::ranges::none_of(all, [](const TensorShape& t) { return t.name == kEmbedding; })) {
    all.push_back({kEmbedding, {kNumActions, static_cast<std::size_t>(config.action_size)}});
  }
  for (const TensorShape& wanted : all) {
    const auto found = tensors.find(wanted.name);
    if (found == tensors.end()) {
      throw Error(where, fmt::format("has no tensor {}", wanted.name),
                  "Give weights of the same configuration, with the present encoder");
    }
    if (found->second.shape != wanted.shape) {
      throw Error(where, fmt::format("{} is of another shape", wanted.name),
                  "Give weights of the same configuration");
    }
    const bool fixed =
        IsStatistic(wanted.name) ||
        (wanted.name == kEmbedding && config.action_embedding != ActionEmbedding::kLearned);
    tensors_[wanted.name] = wandr::TorchTensorOf(found->second).requires_grad_(!fixed);
  }
}

const torch::Tensor& TorchNetworks::At(const std::string& name) const {
  return tensors_.find(name)->second;
}

torch::Tensor TorchNetworks::Linear(const torch::Tensor& x, const std::string& name) const {
  return torch::linear(x, At(name + ".weight"), At(name + ".bias"));
}

torch::Tensor TorchNetworks::BatchNorm(const torch::Tensor& x, const std::string& name,
                                       Pass& pass) const {
  const torch::Tensor &mean = At(name + ".running_mean"), &variance = At(name + ".running_var");
  Pass::Statistics statistics{mean, variance};
  if (pass.batch_statistics) {
    const auto [found, is_new] = pass.running.try_emplace(name);
    if (is_new) found->second = {mean.clone(), variance.clone()};
    statistics = found->second;
  }
  return std::get<0>(torch::native_batch_norm(x, At(name + ".weight"), At(name + ".bias"),
                                              statistics.mean, statistics.variance,
                                              pass.batch_statistics, kMomentum, kBatchNormEpsilon));
}

torch::Tensor TorchNetworks::Block(const torch::Tensor& x, const std::string& name,
                                   Pass& pass) const {
  torch::Tensor h = LeakyRelu(BatchNorm(Linear(x, name + ".fc1"), name + ".bn1", pass));
  h = BatchNorm(Linear(Dropped(h, pass), name + ".fc2"), name + ".bn2", pass);
  const bool same = !tensors_.contains(name + ".fc3.weight");
  return LeakyRelu((same ? x : LeakyRelu(Linear(x, name + ".fc3"))) + h);
}

torch::Tensor TorchNetworks::Condition(const ConditionInput& input, bool with_object,
                                       const std::string& module, Pass& pass) const {
  std::vector<torch::Tensor> parts{input.betas};
  if (with_object) parts.push_back(input.object);
  parts.push_back(At(kEmbedding).index_select(0, input.action));
  const torch::Tensor x = BatchNorm(torch::cat(parts, 1), module + ".enc_bn0", pass);
  return Block(x, module + ".enc_rb0", pass);
}

torch::Tensor TorchNetworks::ArmsCondition(const ConditionInput& input, Pass& pass) const {
  return Condition(input, config_.arms_see_class, "arms", pass);
}

torch::Tensor TorchNetworks::BodyCondition(const ConditionInput& input, Pass& pass) const {
  return Condition(input, true, "body", pass);
}

Latents TorchNetworks::Encode(const torch::Tensor& input, const std::string& module,
                              const std::string& suffix, const std::string& latent,
                              Pass& pass) const {
  const torch::Tensor x0 = BatchNorm(input, module + ".enc_bn1" + suffix, pass);
  const torch::Tensor x1 = Block(x0, module + ".enc_rb1" + suffix, pass);
  const torch::Tensor x2 = Block(torch::cat({x0, x1}, 1), module + ".enc_rb2" + suffix, pass);
  return {Linear(x2, module + ".mu_" + latent), Linear(x2, module + ".sigma_" + latent)};
}

Latents TorchNetworks::ArmsPresent(const torch::Tensor& input, Pass& pass) const {
  return Encode(input, "arms", "", "present", pass);
}

Latents TorchNetworks::ArmsPast(const torch::Tensor& past, const torch::Tensor& phi,
                                Pass& pass) const {
  return Encode(torch::cat({past, phi}, 1), "arms", "_past", "past", pass);
}

torch::Tensor TorchNetworks::ArmsDecode(const torch::Tensor& latent, const torch::Tensor& past,
                                        const torch::Tensor& phi, Pass& pass) const {
  const torch::Tensor y0 = torch::cat({phi, latent, past}, 1);
  const torch::Tensor y1 = Block(BatchNorm(y0, "arms.dec_bn1", pass), "arms.dec_rb1", pass);
  return Block(torch::cat({y0, y1}, 1), "arms.dec_rb2", pass);
}

torch::Tensor TorchNetworks::Attend(const torch::Tensor& pose, Pass& pass) const {
  const std::int64_t rows = pose.size(0), joints = config_.BodyJoints();
  if (!config_.self_attention) return pose;
  const std::int64_t heads = config_.attention_heads, width = config_.attention_width;
  const torch::Tensor tokens = pose.reshape({rows, joints, kRotationSize}) + positions_;
  // (poses x heads x joints x width)
  const auto projected = [&](const torch::Tensor& x, const std::string& weight) {
    return torch::linear(x, At(weight)).view({rows, joints, heads, width}).transpose(1, 2);
  };
  torch::Tensor x = tokens;
  for (int l = 0; l < config_.attention_layers; ++l) {
    const std::string name = fmt::format("body.attention_model.attention_layers.{}.attn.", l);
    const torch::Tensor q = projected(x, name + "w_qs.weight");
    const torch::Tensor k = projected(tokens, name + "w_ks.weight");
    const torch::Tensor v = projected(tokens, name + "w_vs.weight");
    const torch::Tensor scores =
        torch::matmul(q / std::sqrt(static_cast<double>(width)), k.transpose(2, 3));
    const torch::Tensor attention = Dropped(torch::softmax(scores, -1), pass);
    const torch::Tensor heard =
        torch::matmul(attention, v).transpose(1, 2).reshape({rows, joints, heads * width});
    x = x + Dropped(torch::linear(heard, At(name + "w_combine.weight")), pass);
    x = torch::layer_norm(x, {joints, kRotationSize}, At(name + "layer_norm.weight"),
                          At(name + "layer_norm.bias"), kLayerNormEpsilon);
  }
  return x.reshape({rows, -1});
}

Latents TorchNetworks::BodyPast(const torch::Tensor& input, Pass& pass) const {
  return Encode(input, "body", "_past", "past", pass);
}

torch::Tensor TorchNetworks::BodyDecode(const torch::Tensor& latent, const torch::Tensor& input,
                                        Pass& pass) const {
  const torch::Tensor y0 = torch::cat({latent, input}, 1);
  const torch::Tensor y1 = Block(BatchNorm(y0, "body.dec_bn1", pass), "body.dec_rb1", pass);
  return Block(torch::cat({y0, y1}, 1), "body.dec_rb2", pass);
}

std::vector<torch::Tensor> TorchNetworks::Parameters(const std::string& prefix) const {
  std::vector<torch::Tensor> all;
  for (const auto& [name, tensor] : tensors_) {
    if (!tensor.requires_grad()) continue;
    if (name.starts_with(prefix) || name == kEmbedding) all.push_back(tensor);
  }
  return all;
}

long TorchNetworks::NumParameters() const {
  long count = 0;
  for (const torch::Tensor& parameter : Parameters()) count += parameter.numel();
  return count;
}

void TorchNetworks::TakeStatistics(std::span<const Pass* const> passes) {
  const torch::NoGradGuard no_gradients;
  for (const auto& [name, first] : passes.front()->running) {
    torch::Tensor mean = first.mean, variance = first.variance;
    for (const Pass* pass : passes.subspan(1)) {
      mean = mean + pass->running.find(name)->second.mean;
      variance = variance + pass->running.find(name)->second.variance;
    }
    const double share = 1.0 / static_cast<double>(passes.size());
    tensors_.find(name + ".running_mean")->second.copy_(mean * share);
    tensors_.find(name + ".running_var")->second.copy_(variance * share);
  }
}

nn::TensorMap TorchNetworks::Tensors() const {
  nn::TensorMap out;
  for (const auto& [name, values] : tensors_) out[name] = wandr::TensorOf(values);
  return out;
}

nn::TensorMap StartingTensors(const Config& config, bool as_published, std::uint64_t seed,
                              const Eigen::MatrixXf& embeddings) {
  nn::TensorMap all = RandomNetwork(config, seed, true).tensors;
  if (!as_published) {
    nn::RandomStream random(seed, 0x1305);
    for (auto& [name, tensor] : all) {
      const bool weight = name.ends_with(".weight");
      const bool last = name.find(".dec_rb2.") != std::string::npos;
      if (IsStatistic(name) || name == kEmbedding) continue;
      if (IsNorm(name)) {
        const bool small = last && name.find(".bn2.") != std::string::npos;
        std::ranges::fill(tensor.values, weight ? (small ? kSmallStart : 1.0f) : 0.0f);
      } else if (weight) {
        const bool small = last && name.find(".fc3.") != std::string::npos;
        const double bound =
            (small ? kSmallStart : 1.0) / std::sqrt(static_cast<double>(tensor.shape.back()));
        for (float& value : tensor.values) {
          value = static_cast<float>(bound * (2.0 * random.Uniform() - 1.0));
        }
      } else {
        std::ranges::fill(tensor.values, 0.0f);
      }
    }
  }
  if (embeddings.size() > 0) all[kEmbedding] = nn::MatrixTensor(embeddings);
  return all;
}

}  // namespace holdfast::imos
