// SPDX-License-Identifier: MIT
#include "generator/imos/config.h"

#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::imos {
namespace {

constexpr int kMaxWidth = 65536;
constexpr int kMaxAttentionLayers = 64;

// Texts of the values of an option in files, in their order; none for numbers.
using Words = std::initializer_list<std::string_view>;

template <typename Value>
std::string TextOf(Value value, Words words) {
  const int number = static_cast<int>(value);
  return words.size() == 0 ? std::to_string(number) : std::string(words.begin()[number]);
}

template <typename Value>
bool FromText(std::string_view text, Words words, Value& value) {
  int number = 0;
  if (words.size() == 0) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return false;
  } else {
    const auto found = std::find(words.begin(), words.end(), text);
    if (found == words.end()) return false;
    number = static_cast<int>(found - words.begin());
  }
  value = static_cast<Value>(number);
  return true;
}

// Visits every option with its name in files, so that reading, writing and checking agree.
template <typename ConfigType, typename Visit>
void ForEachSize(ConfigType& config, const Visit& visit) {
  visit("action_size", config.action_size, {});
  visit("block_width", config.block_width, {});
  visit("arms_condition", config.arms_condition, {});
  visit("arms_first", config.arms_first, {});
  visit("arms_second", config.arms_second, {});
  visit("arms_decoder", config.arms_decoder, {});
  visit("arms_latent", config.arms_latent, {});
  visit("body_condition", config.body_condition, {});
  visit("body_first", config.body_first, {});
  visit("body_second", config.body_second, {});
  visit("body_decoder", config.body_decoder, {});
  visit("body_latent", config.body_latent, {});
  visit("attention_layers", config.attention_layers, {});
  visit("attention_heads", config.attention_heads, {});
  visit("attention_width", config.attention_width, {});
}
template <typename ConfigType, typename Visit>
void ForEachOption(ConfigType& config, const Visit& visit) {
  visit("modules", config.has_arms, {"one", "two"});
  visit("self_attention", config.self_attention, {"no", "yes"});
  visit("attended_past", config.keeps_past_poses, {"instead", "beside"});
  visit("sees_progress", config.sees_progress, {"no", "yes"});
  visit("action_embedding", config.action_embedding, {"given", "learned", "random"});
  visit("arms_see_class", config.arms_see_class, {"no", "yes"});
  visit("arms_object", config.arms_see_object_pose, {"translation", "pose"});
  visit("body_sees_arms_now", config.body_sees_arms_now, {"no", "yes"});
  visit("object_now", config.object_now, {"absent", "previous", "true"});
  visit("arm_order", config.arm_order, {"16,17,18,19,20,21", "17,19,21,16,18,20"});
  visit("root", config.predicts_root, {"given", "predicted"});
  visit("body_makes", config.makes_steps, {"pose", "step"});
  visit("object_rotation", config.object_rotation, {"columns", "rows"});
  ForEachSize(config, visit);
}

class TensorList {
 public:
  void Vector(const std::string& name, int size) { list.push_back({name, {Size(size)}}); }
  void Matrix(const std::string& name, int rows, int columns) {
    list.push_back({name, {Size(rows), Size(columns)}});
  }
  void Linear(const std::string& name, int in, int out) {
    Matrix(name + ".weight", out, in);
    Vector(name + ".bias", out);
  }
  void BatchNorm(const std::string& name, int size) {
    for (const char* part : {".weight", ".bias", ".running_mean", ".running_var"}) {
      Vector(name + part, size);
    }
  }
  void Block(const std::string& name, int in, int width, int out) {
    Linear(name + ".fc1", in, width);
    BatchNorm(name + ".bn1", width);
    Linear(name + ".fc2", width, out);
    BatchNorm(name + ".bn2", out);
    if (in != out) Linear(name + ".fc3", in, out);
  }

  std::vector<TensorShape> list;

 private:
  static std::size_t Size(int size) { return static_cast<std::size_t>(size); }
};

void AddArms(const Config& c, bool training, TensorList& tensors) {
  const int width = c.block_width;
  tensors.BatchNorm("arms.enc_bn0", c.ArmsConditionInput());
  tensors.Block("arms.enc_rb0", c.ArmsConditionInput(), width, c.arms_condition);
  const auto encoder = [&](int input, const std::string& suffix, const std::string& latent) {
    tensors.BatchNorm("arms.enc_bn1" + suffix, input);
    tensors.Block("arms.enc_rb1" + suffix, input, width, c.arms_first);
    tensors.Block("arms.enc_rb2" + suffix, input + c.arms_first, width, c.arms_second);
    tensors.Linear("arms.mu_" + latent, c.arms_second, c.arms_latent);
    tensors.Linear("arms.sigma_" + latent, c.arms_second, c.arms_latent);
  };
  if (training) encoder(c.ArmsPresentInput(), "", "present");
  encoder(c.ArmsPastInput(), "_past", "past");
  const int input = c.ArmsDecoderInput();
  tensors.BatchNorm("arms.dec_bn1", input);
  tensors.Block("arms.dec_rb1", input, width, c.arms_decoder);
  tensors.Block("arms.dec_rb2", input + c.arms_decoder, width, kArmsSize);
}

void AddBody(const Config& c, TensorList& tensors) {
  const int width = c.block_width;
  tensors.BatchNorm("body.enc_bn0", c.BodyConditionInput());
  tensors.Block("body.enc_rb0", c.BodyConditionInput(), width, c.body_condition);
  const int all_heads = c.attention_heads * c.attention_width;
  for (int l = 0; c.self_attention && l < c.attention_layers; ++l) {
    const std::string name = fmt::format("body.attention_model.attention_layers.{}.attn.", l);
    for (const char* part : {"w_qs", "w_ks", "w_vs"}) {
      tensors.Matrix(name + part + ".weight", all_heads, kRotationSize);
    }
    tensors.Matrix(name + "w_combine.weight", kRotationSize, all_heads);
    tensors.Matrix(name + "layer_norm.weight", c.BodyJoints(), kRotationSize);
    tensors.Matrix(name + "layer_norm.bias", c.BodyJoints(), kRotationSize);
  }
  const int past = c.BodyPastInput(), input = c.BodyDecoderInput();
  tensors.BatchNorm("body.enc_bn1_past", past);
  tensors.Block("body.enc_rb1_past", past, width, c.body_first);
  tensors.Block("body.enc_rb2_past", past + c.body_first, width, c.body_second);
  tensors.Linear("body.mu_past", c.body_second, c.body_latent);
  tensors.Linear("body.sigma_past", c.body_second, c.body_latent);
  tensors.BatchNorm("body.dec_bn1", input);
  tensors.Block("body.dec_rb1", input, width, c.body_decoder);
  tensors.Block("body.dec_rb2", input + c.body_decoder, width, c.BodyOutput());
}

}  // namespace

int Config::ArmsConditionInput() const {
  return kNumBetas + (arms_see_class ? kNumObjects : 0) + action_size;
}
int Config::ArmsPresentInput() const { return kArmsSize + ArmsObjectSize() + arms_condition; }
int Config::ArmsPastInput() const {
  return kHistory * (kArmsSize + ArmsObjectSize()) + ProgressSize() + arms_condition;
}
int Config::ArmsDecoderInput() const { return ArmsPastInput() + arms_latent; }
int Config::BodyConditionInput() const { return kNumBetas + kNumObjects + action_size; }
int Config::BodyPastInput() const {
  int size = kHistory * (BodyPastPoseSize() + kObjectSize) + ProgressSize() + body_condition;
  if (has_arms) size += kHistory * kArmsSize + (body_sees_arms_now ? kArmsSize : 0);
  if (object_now != ObjectInput::kAbsent) size += kObjectSize;
  if (predicts_root) size += kHistory * 3;
  return size;
}
int Config::BodyDecoderInput() const { return body_latent + BodyPastInput(); }
int Config::BodyOutput() const { return BodyPoseSize() + (predicts_root ? 3 : 0); }

Config PaperConfig() { return {}; }

Config CompactConfig() {
  Config config;
  config.action_embedding = ActionEmbedding::kLearned;
  config.action_size = 32;
  config.arms_see_class = true;
  config.keeps_past_poses = true;
  config.sees_progress = true;
  config.arms_see_object_pose = true;
  config.object_now = ObjectInput::kPrevious;
  config.predicts_root = true;
  config.makes_steps = true;
  config.object_rotation = ObjectRotation::kColumns;
  config.block_width = 192;
  config.arms_condition = 128;
  config.arms_first = 512;
  config.arms_second = 256;
  config.arms_decoder = 512;
  config.body_first = 256;
  config.body_second = 128;
  config.body_decoder = 256;
  return config;
}

void CheckConfig(const Config& config, const std::string& where) {
  ForEachSize(config, [&](const char* name, int value, Words) {
    if (value < 1 || value > kMaxWidth) {
      throw Error(where, fmt::format("'{}' is {}, not in 1..{}", name, value, kMaxWidth),
                  kWeightsRemedy);
    }
  });
  const long all_heads = long{config.attention_heads} * config.attention_width;
  if (all_heads > kMaxWidth || config.attention_layers > kMaxAttentionLayers) {
    throw Error(where,
                fmt::format("attention has {} layers and {} rows; the maximum is {} and {}",
                            config.attention_layers, all_heads, kMaxAttentionLayers, kMaxWidth),
                kWeightsRemedy);
  }
}

std::map<std::string, std::string> ConfigTexts(const Config& config) {
  std::map<std::string, std::string> texts;
  ForEachOption(config, [&](const char* name, const auto& value, Words words) {
    texts[name] = TextOf(value, words);
  });
  return texts;
}

Config ConfigFromTexts(std::map<std::string, std::string>& texts, const std::string& where) {
  Config config;
  ForEachOption(config, [&](const char* name, auto& value, Words words) {
    const auto text = texts.extract(name);
    if (text.empty()) {
      throw Error(where, fmt::format("its metadata lacks '{}'", name), kWeightsRemedy);
    }
    if (!FromText(text.mapped(), words, value)) {
      throw Error(where, fmt::format("'{}' has the unknown value '{}'", name, text.mapped()),
                  kWeightsRemedy);
    }
  });
  CheckConfig(config, where);
  return config;
}

std::vector<TensorShape> TensorsOf(const Config& config, bool training) {
  TensorList tensors;
  if (config.action_embedding != ActionEmbedding::kGiven) {
    tensors.Matrix("action_embedding.weight", kNumActions, config.action_size);
  }
  if (config.has_arms) AddArms(config, training, tensors);
  AddBody(config, tensors);
  return std::move(tensors.list);
}

}  // namespace holdfast::imos
