// SPDX-License-Identifier: MIT
#include "generator/imos/recognition.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "generator/nn/random_stream.h"
#include "geometry/error.h"
#include "geometry/io/container/safetensors.h"
#include "geometry/parallel.h"

namespace holdfast::imos {
namespace {

constexpr const char* kRecognizerFormat = "imos-recognizer-1";
constexpr const char* kRecognizerRemedy = "Give a file that 'holdfast.train recognizer' wrote";

constexpr int kHidden = kRecognizerFeatures;
constexpr int kGates = 4 * kHidden;
constexpr int kPlaneInputs = 2 * kMetricJoints;
constexpr int kBlock = 32;  // motions per pass over the weights

// Coordinates given to the two LSTMs.
constexpr int kPlanes[2][2] = {{0, 1}, {0, 2}};

// Coordinates of one plane in frame t in the network's order: joint by joint.
void PlaneOf(const JointMotion& motion, Eigen::Index t, int plane, Eigen::Ref<Eigen::VectorXf> to) {
  for (int j = 0; j < kMetricJoints; ++j) {
    for (int c = 0; c < 2; ++c) {
      to[2 * j + c] = static_cast<float>(motion(3 * j + kPlanes[plane][c], t));
    }
  }
}

Eigen::ArrayXXf Sigmoid(const Eigen::Ref<const Eigen::ArrayXXf>& x) {
  return 0.5f * (0.5f * x).tanh() + 0.5f;
}

void RequireMotions(std::span<const JointMotion> motions) {
  for (const JointMotion& motion : motions) {
    if (motion.rows() != 3 * kMetricJoints || motion.cols() < 1 ||
        motion.cols() != motions[0].cols()) {
      throw Error(
          "joints",
          fmt::format("are {} x {}, {} x {} is needed", motion.rows(), motion.cols(),
                      3 * kMetricJoints, std::max<Eigen::Index>(motions[0].cols(), 1)),
          "Give the 22 body joints in every key frame, with the same number of key frames for all");
    }
    if (!motion.allFinite()) {
      throw Error("joints", "are not finite numbers", "Use weights whose training did not diverge");
    }
  }
}

}  // namespace

RecognizerWeights RandomRecognizer(std::uint64_t seed) {
  nn::RandomStream random(seed);
  RecognizerWeights weights;
  const auto add = [&](const std::string& name, std::vector<std::size_t> shape, double fan_in) {
    std::size_t size = 1;
    for (const std::size_t length : shape) size *= length;
    nn::Tensor tensor{std::move(shape), std::vector<float>(size)};
    const double bound = 1.0 / std::sqrt(fan_in);
    for (float& value : tensor.values) {
      value = static_cast<float>(bound * (2.0 * random.Uniform() - 1.0));
    }
    weights.tensors[name] = std::move(tensor);
  };
  for (const char* plane : {"2_2", "2_3"}) {
    for (int layer = 0; layer < 2; ++layer) {
      const auto name = [&](const char* what) {
        return fmt::format("lstm{}.{}_l{}", plane, what, layer);
      };
      const std::size_t inputs = layer == 0 ? kPlaneInputs : kHidden;
      add(name("weight_ih"), {kGates, inputs}, kHidden);
      add(name("weight_hh"), {kGates, kHidden}, kHidden);
      add(name("bias_ih"), {kGates}, kHidden);
      add(name("bias_hh"), {kGates}, kHidden);
    }
    add(fmt::format("conv1_{}.weight", plane), {1, 1, 3}, 3);
    add(fmt::format("conv1_{}.bias", plane), {1}, 3);
  }
  add("hidden2label.weight", {kNumActions, kHidden}, kHidden);
  add("hidden2label.bias", {kNumActions}, kHidden);
  return weights;
}

RecognizerWeights ReadRecognizer(const std::filesystem::path& path) {
  const SafetensorsReader file(path);
  RecognizerWeights weights;
  weights.notes = file.Metadata();
  if (const auto format = weights.notes.extract("format"); !format.empty()) {
    // "pt" is written by PyTorch itself.
    if (format.mapped() != kRecognizerFormat && format.mapped() != "pt") {
      throw Error(path.string(),
                  fmt::format("its format is '{}', not '{}'", format.mapped(), kRecognizerFormat),
                  kRecognizerRemedy);
    }
  }
  for (const std::string& name : file.Names()) {
    const NpyMember member = file.Read(name);
    weights.tensors[name] = {member.array.shape, member.AsFloats()};
  }
  const Recognizer checked(weights, path.string());
  return weights;
}

void WriteRecognizer(const RecognizerWeights& weights, const std::filesystem::path& path) {
  SafetensorsWriter writer;
  for (const auto& [name, tensor] : weights.tensors) {
    writer.AddFloat32(name, tensor.shape, tensor.values);
  }
  SafetensorsMetadata metadata(weights.notes.begin(), weights.notes.end());
  metadata["format"] = kRecognizerFormat;
  writer.SetMetadata(std::move(metadata));
  writer.Write(path);
}

Recognizer::Lstm Recognizer::ReadLstm(const nn::TensorMap& tensors, const std::string& lstm,
                                      const std::string& convolution, const std::string& where) {
  Lstm read;
  for (int layer = 0; layer < 2; ++layer) {
    const auto name = [&](const char* what) { return fmt::format("{}.{}_l{}", lstm, what, layer); };
    const int inputs = layer == 0 ? kPlaneInputs : kHidden;
    Eigen::MatrixXf joined(kGates, inputs + kHidden);
    joined << nn::ReadMatrix(tensors, name("weight_ih"), where, kGates, inputs),
        nn::ReadMatrix(tensors, name("weight_hh"), where, kGates, kHidden);
    read.matrices[layer] = nn::PackedMatrix<float>(joined);
    read.biases[layer] = nn::ReadVector(tensors, name("bias_ih"), where, kGates) +
                         nn::ReadVector(tensors, name("bias_hh"), where, kGates);
  }
  // One input and one output channel, so the kernel is a vector.
  nn::TensorMap kernel;
  const std::string weight = convolution + ".weight";
  if (const auto found = tensors.find(weight); found != tensors.end()) {
    kernel[weight] = {{found->second.values.size()}, found->second.values};
  }
  read.kernel = nn::ReadVector(kernel, weight, where, 3);
  read.kernel_bias = nn::ReadVector(tensors, convolution + ".bias", where, 1)[0];
  return read;
}

Recognizer::Recognizer(const RecognizerWeights& weights, const std::string& where)
    : loops_(&nn::LoopsFor<float>(BestIsa())),
      planes_{ReadLstm(weights.tensors, "lstm2_2", "conv1_2_2", where),
              ReadLstm(weights.tensors, "lstm2_3", "conv1_2_3", where)},
      labels_(nn::ReadMatrix(weights.tensors, "hidden2label.weight", where, kNumActions, kHidden)),
      labels_bias_(nn::ReadVector(weights.tensors, "hidden2label.bias", where, kNumActions)) {}

void Recognizer::Run(const Lstm& lstm, std::span<const Eigen::MatrixXf> steps,
                     Eigen::MatrixXf& y) const {
  const Eigen::Index columns = y.cols();
  Eigen::MatrixXf inputs[2] = {Eigen::MatrixXf::Zero(kPlaneInputs + kHidden, columns),
                               Eigen::MatrixXf::Zero(2 * kHidden, columns)};
  Eigen::ArrayXXf cells[2] = {Eigen::ArrayXXf::Zero(kHidden, columns),
                              Eigen::ArrayXXf::Zero(kHidden, columns)};
  Eigen::MatrixXf gates(kGates, columns);
  Eigen::MatrixXf output;
  for (const Eigen::MatrixXf& step : steps) {
    inputs[0].topRows(kPlaneInputs) = step;
    for (int layer = 0; layer < 2; ++layer) {
      Eigen::MatrixXf& input = inputs[layer];
      lstm.matrices[layer].Multiply(*loops_, input.data(), input.outerStride(),
                                    static_cast<int>(columns), gates.data(), gates.outerStride(),
                                    nullptr);
      gates.colwise() += lstm.biases[layer];
      const auto gate = [&](int k) { return gates.middleRows(k * kHidden, kHidden).array(); };
      cells[layer] = Sigmoid(gate(1)) * cells[layer] + Sigmoid(gate(0)) * gate(2).tanh();
      output = (Sigmoid(gate(3)) * cells[layer].tanh()).matrix();
      input.bottomRows(kHidden) = output;
      if (layer == 0) inputs[1].topRows(kHidden) = output;
    }
  }
  for (int i = 0; i < kHidden; ++i) {
    auto row = y.row(i);
    row.array() += lstm.kernel_bias;
    for (int k = 0; k < 3; ++k) {
      const int from = i + k - 1;
      if (from >= 0 && from < kHidden) row += lstm.kernel[k] * output.row(from);
    }
  }
}

void Recognizer::RecognizeBlock(std::span<const JointMotion> motions, Eigen::Index first,
                                Recognition& result) const {
  const auto columns = std::ssize(motions);
  const Eigen::Index frames = motions[0].cols();
  Eigen::MatrixXf y = Eigen::MatrixXf::Zero(kHidden, columns);
  std::vector<Eigen::MatrixXf> steps(frames, Eigen::MatrixXf(kPlaneInputs, columns));
  for (int plane = 0; plane < 2; ++plane) {
    for (Eigen::Index t = 0; t < frames; ++t) {
      for (Eigen::Index n = 0; n < columns; ++n) PlaneOf(motions[n], t, plane, steps[t].col(n));
    }
    Run(planes_[plane], steps, y);
  }
  Eigen::MatrixXf logits(nn::PaddedRows(kNumActions), columns);
  labels_.Multiply(*loops_, y.data(), y.outerStride(), static_cast<int>(columns), logits.data(),
                   logits.outerStride(), nullptr);
  result.logits.middleCols(first, columns) = logits.topRows(kNumActions).colwise() + labels_bias_;
  result.features.middleCols(first, columns) = 0.1f * y.array().tanh();
}

Recognition Recognizer::Recognize(std::span<const JointMotion> motions, int threads) const {
  RequireMotions(motions);
  const auto count = std::ssize(motions);
  Recognition result;
  result.logits.resize(kNumActions, count);
  result.features.resize(kRecognizerFeatures, count);
  const int blocks = static_cast<int>((count + kBlock - 1) / kBlock);
  ParallelFor(blocks, threads, [&](int block) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(block) * kBlock;
    RecognizeBlock(motions.subspan(first, std::min<std::ptrdiff_t>(kBlock, count - first)), first,
                   result);
  });
  for (Eigen::Index n = 0; n < count; ++n) {
    // Uses the logits: sigmoids in float are equal if both are close to 1.
    Eigen::Index best = 0;
    result.logits.col(n).maxCoeff(&best);
    result.labels.push_back(static_cast<int>(best));
  }
  return result;
}

}  // namespace holdfast::imos
