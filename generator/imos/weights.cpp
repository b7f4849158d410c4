// SPDX-License-Identifier: MIT
#include "generator/imos/weights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "generator/nn/random_stream.h"
#include "geometry/error.h"
#include "geometry/io/pickle/data_file.h"

namespace holdfast::imos {
namespace {

constexpr const char* kFormat = "imos-1";
constexpr const char* kTableName = "action_embedding.weight";

bool IsPresentEncoder(std::string_view name) {
  for (const char* part : {"enc_bn1.", "enc_rb1.", "enc_rb2.", "mu_present.", "sigma_present."}) {
    if (name.starts_with(std::string("arms.") + part)) return true;
  }
  return false;
}

// Mean and deviation of the published initial distribution of a tensor, by its name.
std::pair<double, double> StartOf(std::string_view name) {
  if (name.ends_with(".running_mean")) return {0.0, 0.0};
  if (name.ends_with(".running_var") || name.ends_with("layer_norm.weight")) return {1.0, 0.0};
  if (name.ends_with("layer_norm.bias")) return {0.0, 0.0};
  if (name == kTableName) return {0.0, 1.0};
  return {0.0, 0.02};
}

std::size_t SizeOf(const std::vector<std::size_t>& shape) {
  std::size_t size = 1;
  for (const std::size_t length : shape) size *= length;
  return size;
}

void CheckTensor(const TensorShape& expected, const nn::TensorMap& tensors,
                 const std::string& where) {
  const auto found = tensors.find(expected.name);
  if (found == tensors.end()) {
    throw Error(where, fmt::format("there is no tensor '{}'", expected.name), kWeightsRemedy);
  }
  const nn::Tensor& tensor = found->second;
  if (tensor.shape != expected.shape || tensor.values.size() != SizeOf(expected.shape)) {
    throw Error(where,
                fmt::format("'{}' is {}, {} is needed", expected.name,
                            fmt::join(tensor.shape, " x "), fmt::join(expected.shape, " x ")),
                kWeightsRemedy);
  }
  if (!std::ranges::all_of(tensor.values, [](float v) { return std::isfinite(v); })) {
    throw Error(where, fmt::format("'{}' holds values that are not finite", expected.name),
                "The training that wrote it diverged: use an earlier checkpoint");
  }
  if (expected.name.ends_with(".running_var") && std::ranges::min(tensor.values) < 0.0f) {
    throw Error(where, fmt::format("'{}' holds negative variances", expected.name), kWeightsRemedy);
  }
}

}  // namespace

NetworkWeights RandomNetwork(const Config& config, std::uint64_t seed, bool training) {
  CheckConfig(config, "network");
  NetworkWeights weights{config, {}, {}};
  std::uint64_t stream = 0;
  for (const TensorShape& shape : TensorsOf(config, training)) {
    nn::RandomStream random(seed, stream++);
    const auto [mean, deviation] = StartOf(shape.name);
    nn::Tensor& tensor = weights.tensors[shape.name];
    tensor = {shape.shape, std::vector<float>(SizeOf(shape.shape))};
    for (float& value : tensor.values) {
      value = static_cast<float>(mean + deviation * random.Normal());
    }
  }
  return weights;
}

NetworkWeights ReadNetwork(const std::filesystem::path& path) {
  return ReadNetwork(SafetensorsReader(path), path.string());
}

NetworkWeights ReadNetwork(const SafetensorsReader& file, const std::string& where) {
  NetworkWeights weights;
  weights.notes = file.Metadata();
  const auto format = weights.notes.extract("format");
  if (format.empty() || format.mapped() != kFormat) {
    throw Error(where,
                format.empty()
                    ? fmt::format("its metadata lacks the format '{}'", kFormat)
                    : fmt::format("its format is '{}', not '{}'", format.mapped(), kFormat),
                kWeightsRemedy);
  }
  weights.config = ConfigFromTexts(weights.notes, where);
  // Reads no tensors that a configuration of these sizes does not have.
  for (const TensorShape& shape : TensorsOf(weights.config, true)) {
    if (!file.Has(shape.name)) continue;
    const NpyMember member = file.Read(shape.name);
    weights.tensors[shape.name] = {member.array.shape, member.AsFloats()};
  }
  if (file.Has(kTableName) && !weights.HasActionTable()) {
    const NpyMember member = file.Read(kTableName);
    weights.tensors[kTableName] = {member.array.shape, member.AsFloats()};
  }
  for (const std::string& name : file.Names()) {
    if (!weights.tensors.contains(name)) {
      throw Error(where, fmt::format("networks of this configuration have no tensor '{}'", name),
                  kWeightsRemedy);
    }
  }
  CheckNetwork(weights, where);
  return weights;
}

void WriteNetwork(const NetworkWeights& weights, const std::filesystem::path& path, bool half) {
  CheckNetwork(weights, path.string());
  SafetensorsWriter writer;
  for (const auto& [name, tensor] : weights.tensors) {
    if (half && tensor.shape.size() > 1) {
      writer.AddFloat16(name, tensor.shape, tensor.values);
    } else {
      writer.AddFloat32(name, tensor.shape, tensor.values);
    }
  }
  SafetensorsMetadata metadata(weights.notes.begin(), weights.notes.end());
  for (auto& [name, text] : ConfigTexts(weights.config)) metadata[name] = text;
  metadata["format"] = kFormat;
  writer.SetMetadata(std::move(metadata));
  writer.Write(path);
}

void CheckNetwork(const NetworkWeights& weights, const std::string& where) {
  CheckConfig(weights.config, where);
  std::vector<TensorShape> expected = TensorsOf(weights.config, weights.HasPresentEncoder());
  if (weights.HasActionTable() && weights.config.action_embedding == ActionEmbedding::kGiven) {
    expected.push_back(
        {kTableName,
         {std::size_t{kNumActions}, static_cast<std::size_t>(weights.config.action_size)}});
  }
  for (const TensorShape& shape : expected) CheckTensor(shape, weights.tensors, where);
  if (expected.size() == weights.tensors.size()) return;
  for (const auto& [name, tensor] : weights.tensors) {
    if (std::ranges::find(expected, name, &TensorShape::name) == expected.end()) {
      throw Error(where, fmt::format("networks of this configuration have no tensor '{}'", name),
                  kWeightsRemedy);
    }
  }
}

NetworkWeights WithoutTraining(NetworkWeights weights) {
  std::erase_if(weights.tensors, [](const auto& item) { return IsPresentEncoder(item.first); });
  return weights;
}

Eigen::MatrixXf ActionTable(const NetworkWeights& weights) {
  if (!weights.HasActionTable()) {
    throw Error("action embedding",
                fmt::format("the networks need an embedding of {} numbers, but their file has none",
                            weights.config.action_size),
                "Pass the embedding table to import-weights with --actions, which stores it with "
                "the networks");
  }
  return nn::ReadMatrix(weights.tensors, kTableName, "network", kNumActions,
                        weights.config.action_size);
}

Eigen::MatrixXf ReadActionTable(const std::filesystem::path& path, int action_size) {
  const DataFile file(path);
  Eigen::MatrixXf table(kNumActions, action_size);
  std::optional<DataValue> all = file.Find("embeddings");
  if (!all) all = file.Find(kTableName);
  if (all) {
    const NpyMember member = all->Array();
    if (member.array.shape !=
        std::vector<std::size_t>{std::size_t{kNumActions}, static_cast<std::size_t>(action_size)}) {
      throw Error(all->Where(),
                  fmt::format("it is {}, {} x {} is needed", fmt::join(member.array.shape, " x "),
                              kNumActions, action_size),
                  "Give one row for each action, in the order of their ids");
    }
    const std::vector<float> values = member.AsFloats();
    using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    table = Eigen::Map<const RowMajor>(values.data(), kNumActions, action_size);
  } else {
    for (int a = 0; a < kNumActions; ++a) {
      const std::string label(Actions()[static_cast<std::size_t>(a)].label);
      const std::optional<DataValue> value = file.Find(label);
      if (!value) {
        throw Error(path.string(), fmt::format("there is no embedding of '{}'", label),
                    "Give an array for each of the 29 labels, or one called 'embeddings'");
      }
      const std::vector<float> numbers = value->Array().AsFloats();
      if (static_cast<int>(numbers.size()) != action_size) {
        throw Error(value->Where(),
                    fmt::format("it has {} numbers, {} are needed", numbers.size(), action_size),
                    "Embed all labels with the encoder that the networks were trained with");
      }
      table.row(a) = Eigen::Map<const Eigen::RowVectorXf>(numbers.data(), action_size);
    }
  }
  if (!table.allFinite()) {
    throw Error(path.string(), "some embeddings are not finite", "Compute them again");
  }
  return table;
}

int ActionVectorSize(const std::filesystem::path& path) {
  const DataFile file(path);
  for (const char* const name : {"embeddings", kTableName}) {
    const std::optional<DataValue> all = file.Find(name);
    if (!all) continue;
    const std::vector<std::size_t> shape = all->Array().array.shape;
    return shape.size() == 2 ? static_cast<int>(shape[1]) : 0;
  }
  const std::optional<DataValue> first = file.Find(Actions()[0].label);
  return first ? static_cast<int>(first->Array().AsFloats().size()) : 0;
}

std::optional<NearestAction> FindNearestAction(const std::filesystem::path& path,
                                               const std::string& sentence,
                                               std::span<const std::string> offered) {
  const DataFile file(path);
  const std::optional<DataValue> value = file.Find(sentence);
  if (!value) return std::nullopt;
  const std::vector<float> numbers = value->Array().AsFloats();
  const auto size = static_cast<int>(numbers.size());
  const Eigen::MatrixXf table = ReadActionTable(path, size);
  const Eigen::RowVectorXf vector = Eigen::Map<const Eigen::RowVectorXf>(numbers.data(), size);
  NearestAction nearest{-1, -2.0};
  for (const std::string& label : offered) {
    const int action = ActionId(label);
    const Eigen::RowVectorXf row = table.row(action);
    const double cosine = row.dot(vector) / std::max(row.norm() * vector.norm(), 1e-12f);
    if (cosine > nearest.cosine) nearest = {action, cosine};
  }
  if (nearest.action < 0) {
    throw Error(path.string(), fmt::format("the vector of \"{}\" is not finite", sentence),
                "Compute it again");
  }
  return nearest;
}

namespace {

constexpr const char* kCheckpointRemedy =
    "Give the arms' and the body's checkpoint of IMoS as its training code saves them, in that "
    "order";

// Tensors of the networks, by the names of their modules.
constexpr std::array<std::string_view, 15> kParts{
    "enc_bn0.",       "enc_rb0.",    "enc_bn1.",      "enc_rb1.",      "enc_rb2.",
    "mu_present.",    "mu_past.",    "enc_bn1_past.", "enc_rb1_past.", "enc_rb2_past.",
    "sigma_present.", "sigma_past.", "dec_bn1.",      "dec_rb1.",      "dec_rb2."};

bool IsOfNetwork(std::string_view name) {
  if (name.ends_with("num_batches_tracked")) return false;
  return name.starts_with("attention_model.") ||
         std::ranges::any_of(kParts, [&](std::string_view part) { return name.starts_with(part); });
}

// Returns the state dictionary, wherever the file stores it.
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
    throw Error(path.string(), "it has no tensor that belongs to IMoS's networks",
                kCheckpointRemedy);
  }
}

// Finds the options of Body Synthesis for a given input size of its past encoder. The sizes are
// distinct for all choices.
void FindBodyInputs(int inputs, const std::string& where, Config& config) {
  for (const bool arms_now : {true, false}) {
    for (const ObjectInput now : {ObjectInput::kTrue, ObjectInput::kAbsent}) {
      config.body_sees_arms_now = arms_now;
      config.object_now = now;
      if (config.BodyPastInput() == inputs) return;
    }
  }
  throw Error(where,
              fmt::format("the body's past encoder takes {} values, which matches no configuration",
                          inputs),
              kCheckpointRemedy);
}

Config ConfigOfShapes(const nn::TensorMap& tensors, const std::string& where,
                      const ImportWeightsOptions& options) {
  // Size of a matrix.
  const auto length = [&](const std::string& name, std::size_t axis) {
    const auto found = tensors.find(name);
    if (found == tensors.end()) {
      throw Error(where, fmt::format("there is no tensor '{}'", name), kCheckpointRemedy);
    }
    if (found->second.shape.size() != 2 || found->second.shape[axis] > 1'000'000) {
      throw Error(where, fmt::format("'{}' is not a weight matrix", name), kCheckpointRemedy);
    }
    return static_cast<int>(found->second.shape[axis]);
  };
  const auto rows = [&](const std::string& name) { return length(name, 0); };
  const auto columns = [&](const std::string& name) { return length(name, 1); };
  Config c;
  c.arm_order = options.arm_order;
  c.object_rotation = options.object_rotation;
  c.block_width = rows("arms.enc_rb0.fc1.weight");
  c.arms_condition = rows("arms.enc_rb0.fc2.weight");
  c.arms_first = rows("arms.enc_rb1_past.fc2.weight");
  c.arms_second = rows("arms.enc_rb2_past.fc2.weight");
  c.arms_decoder = rows("arms.dec_rb1.fc2.weight");
  c.arms_latent = rows("arms.mu_past.weight");
  c.body_condition = rows("body.enc_rb0.fc2.weight");
  c.body_first = rows("body.enc_rb1_past.fc2.weight");
  c.body_second = rows("body.enc_rb2_past.fc2.weight");
  c.body_decoder = rows("body.dec_rb1.fc2.weight");
  c.body_latent = rows("body.mu_past.weight");
  c.action_size = columns("body.enc_rb0.fc1.weight") - kNumBetas - kNumObjects;
  c.arms_see_class = columns("arms.enc_rb0.fc1.weight") == c.BodyConditionInput();
  const int seen = columns("arms.enc_rb1_past.fc1.weight") - c.arms_condition;
  c.arms_see_object_pose = seen == kHistory * (kArmsSize + kObjectSize);
  c.predicts_root = rows("body.dec_rb2.fc2.weight") == kTrunkSize + 3;
  c.attention_layers = 0;
  const auto layer = [](int l) {
    return fmt::format("body.attention_model.attention_layers.{}.attn.w_qs.weight", l);
  };
  while (tensors.contains(layer(c.attention_layers))) ++c.attention_layers;
  c.self_attention = c.attention_layers > 0;
  c.attention_heads = options.attention_heads;
  if (c.self_attention) {
    const int all_heads = rows(layer(0));
    if (c.attention_heads < 1 || all_heads % c.attention_heads != 0) {
      throw Error(where,
                  fmt::format("the {} attention rows cannot be split into {} heads", all_heads,
                              c.attention_heads),
                  "Give the number of heads that the networks were trained with");
    }
    c.attention_width = all_heads / c.attention_heads;
  } else {
    c.attention_layers = Config().attention_layers;  // unused, but must be valid
  }
  FindBodyInputs(columns("body.enc_rb1_past.fc1.weight"), where, c);
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
