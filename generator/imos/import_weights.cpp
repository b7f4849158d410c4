// SPDX-License-Identifier: MIT
#include "generator/imos/import_weights.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/pickle/data_file.h"

namespace holdfast::imos {
namespace {

constexpr const char* kCheckpointRemedy =
    "Give the arms' and the body's checkpoint of IMoS as its training code saves them, in that "
    "order";

// Of the networks, by the names of their modules.
constexpr std::array<std::string_view, 15> kParts{
    "enc_bn0.",       "enc_rb0.",    "enc_bn1.",      "enc_rb1.",      "enc_rb2.",
    "mu_present.",    "mu_past.",    "enc_bn1_past.", "enc_rb1_past.", "enc_rb2_past.",
    "sigma_present.", "sigma_past.", "dec_bn1.",      "dec_rb1.",      "dec_rb2."};

bool IsOfNetwork(std::string_view name) {
  if (name.ends_with("num_batches_tracked")) return false;
  return name.starts_with("attention_model.") ||
         std::ranges::any_of(kParts, [&](std::string_view part) { return name.starts_with(part); });
}

// The state by names, wherever the file keeps it.
DataValue StateOf(const DataValue& root) {
  for (const char* key : {"model_pose", "state_dict", "model"}) {
    if (std::optional<DataValue> inner = root.Find(key)) return *inner;
  }
  return root;
}

void ReadState(const std::filesystem::path& path, const std::string& prefix,
               ImportedWeights& imported) {
  const DataFile file(path);
  const DataValue state = StateOf(file.Root());
  bool any = false;
  for (const std::string& full : state.Names()) {
    constexpr std::string_view kParallel = "module.";
    const std::string name = full.starts_with(kParallel) ? full.substr(kParallel.size()) : full;
    if (!IsOfNetwork(name)) {
      imported.ignored.push_back(prefix + name);
      continue;
    }
    const NpyMember member = state[full].Array();
    imported.weights.tensors[prefix + name] = {member.array.shape, member.AsFloats()};
    any = true;
  }
  if (!any) {
    throw Error(path.string(), "it holds no tensor by a name of IMoS's networks",
                kCheckpointRemedy);
  }
}

class Shapes {
 public:
  Shapes(const nn::TensorMap& tensors, std::string where)
      : tensors_(tensors), where_(std::move(where)) {}

  // Of a matrix.
  int Rows(const std::string& name) const { return Length(name, 0); }
  int Columns(const std::string& name) const { return Length(name, 1); }
  bool Has(const std::string& name) const { return tensors_.contains(name); }

 private:
  int Length(const std::string& name, std::size_t axis) const {
    const auto found = tensors_.find(name);
    if (found == tensors_.end()) {
      throw Error(where_, fmt::format("there is no tensor '{}'", name), kCheckpointRemedy);
    }
    if (found->second.shape.size() != 2 || found->second.shape[axis] > 1'000'000) {
      throw Error(where_, fmt::format("'{}' is not a matrix of a network", name),
                  kCheckpointRemedy);
    }
    return static_cast<int>(found->second.shape[axis]);
  }

  const nn::TensorMap& tensors_;
  std::string where_;
};

// The options of Body Synthesis that give its past encoder this many inputs. Their sizes are such
// that no two choices give the same number.
void FindBodyInputs(int inputs, const std::string& where, Config& config) {
  for (const bool arms_now : {true, false}) {
    for (const ObjectNow now : {ObjectNow::kTrue, ObjectNow::kAbsent}) {
      config.body_sees_arms_now = arms_now;
      config.object_now = now;
      if (config.BodyPastInput() == inputs) return;
    }
  }
  throw Error(
      where,
      fmt::format("the body's past encoder takes {} values, which fits no configuration", inputs),
      kCheckpointRemedy);
}

Config ConfigOfShapes(const nn::TensorMap& tensors, const std::string& where,
                      const ImportWeightsOptions& options) {
  const Shapes shapes(tensors, where);
  Config c;
  c.arm_order = options.arm_order;
  c.object_rotation = options.object_rotation;
  c.block_width = shapes.Rows("arms.enc_rb0.fc1.weight");
  c.arms_condition = shapes.Rows("arms.enc_rb0.fc2.weight");
  c.arms_first = shapes.Rows("arms.enc_rb1_past.fc2.weight");
  c.arms_second = shapes.Rows("arms.enc_rb2_past.fc2.weight");
  c.arms_decoder = shapes.Rows("arms.dec_rb1.fc2.weight");
  c.arms_latent = shapes.Rows("arms.mu_past.weight");
  c.body_condition = shapes.Rows("body.enc_rb0.fc2.weight");
  c.body_first = shapes.Rows("body.enc_rb1_past.fc2.weight");
  c.body_second = shapes.Rows("body.enc_rb2_past.fc2.weight");
  c.body_decoder = shapes.Rows("body.dec_rb1.fc2.weight");
  c.body_latent = shapes.Rows("body.mu_past.weight");
  c.action_size = shapes.Columns("body.enc_rb0.fc1.weight") - kNumBetas - kNumObjects;
  c.arms_see_class = shapes.Columns("arms.enc_rb0.fc1.weight") == c.BodyConditionInput();
  const int seen = shapes.Columns("arms.enc_rb1_past.fc1.weight") - c.arms_condition;
  if (seen == kHistory * (kArmsSize + kObjectSize)) c.arms_object = ArmsObject::kPose;
  if (shapes.Rows("body.dec_rb2.fc2.weight") == kTrunkSize + 3) {
    c.root = RootTranslation::kPredicted;
  }
  c.attention_layers = 0;
  const auto layer = [](int l) {
    return fmt::format("body.attention_model.attention_layers.{}.attn.w_qs.weight", l);
  };
  while (shapes.Has(layer(c.attention_layers))) ++c.attention_layers;
  c.self_attention = c.attention_layers > 0;
  c.attention_heads = options.attention_heads;
  if (c.self_attention) {
    const int all_heads = shapes.Rows(layer(0));
    if (c.attention_heads < 1 || all_heads % c.attention_heads != 0) {
      throw Error(where,
                  fmt::format("attention's {} rows are not those of {} heads", all_heads,
                              c.attention_heads),
                  "Give the number of heads that the networks were made with");
    }
    c.attention_width = all_heads / c.attention_heads;
  } else {
    c.attention_layers = Config().attention_layers;  // means nothing, but must be sound
  }
  FindBodyInputs(shapes.Columns("body.enc_rb1_past.fc1.weight"), where, c);
  CheckConfig(c, where);
  return c;
}

}  // namespace

ImportedWeights ImportWeights(const std::filesystem::path& arms, const std::filesystem::path& body,
                              const ImportWeightsOptions& options) {
  const std::string where = arms.string() + " and " + body.string();
  ImportedWeights imported;
  ReadState(arms, "arms.", imported);
  ReadState(body, "body.", imported);
  NetworkWeights& weights = imported.weights;
  weights.config = ConfigOfShapes(weights.tensors, where, options);
  if (!options.keep_training) weights = WithoutTraining(std::move(weights));
  CheckNetwork(weights, where);
  return imported;
}

}  // namespace holdfast::imos
