// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/rollout.h"
#include "generator/nn/random_stream.h"

/// Networks and rollouts for tests of the IMoS generator.
namespace holdfast::imos::testing {

/// Weights whose every layer does something, by the rule of tests/fixtures/make_imos.py.
inline nn::Tensor DrawnTensor(const TensorShape& of, std::uint64_t seed) {
  std::uint64_t start = 0xcbf29ce484222325ull ^ seed;
  for (const char letter : of.name) {
    start = (start ^ static_cast<unsigned char>(letter)) * 0x100000001b3ull;
  }
  const bool is_vector = of.shape.size() == 1;
  const bool is_norm = of.name.find("layer_norm") != std::string::npos;
  double middle = 0.0, reach = 0.25;
  if (((is_vector || is_norm) && of.name.ends_with(".weight")) ||
      of.name.ends_with(".running_var")) {
    middle = 1.0;
    reach = 0.5;
  } else if (!is_vector && !is_norm) {
    int bits = 0;
    while (of.shape[1] >> bits) ++bits;
    reach = std::ldexp(1.0, -(bits / 2));
  }
  std::size_t size = 1;
  for (const std::size_t length : of.shape) size *= length;
  nn::Tensor tensor{of.shape, std::vector<float>(size)};
  nn::RandomStream random(start);
  for (float& value : tensor.values) {
    const double level = (static_cast<double>(random.Next() >> 60) - 7.5) / 8.0;
    value = static_cast<float>(middle + reach * level);
  }
  return tensor;
}

inline NetworkWeights DrawnNetwork(const Config& config, std::uint64_t seed,
                                   bool training = false) {
  NetworkWeights weights{config, {}, {}};
  for (const TensorShape& of : TensorsOf(config, training)) {
    weights.tensors[of.name] = DrawnTensor(of, seed);
  }
  return weights;
}

/// Narrow layers, odd sizes.
inline Config SmallConfig() {
  Config config = CompactConfig();
  config.action_size = 7;
  config.block_width = 9;
  config.arms_condition = 6;
  config.arms_first = 19;
  config.arms_second = 11;
  config.arms_decoder = 17;
  config.arms_latent = 4;
  config.body_condition = 5;
  config.body_first = 14;
  config.body_second = 10;
  config.body_decoder = 13;
  config.body_latent = 6;
  return config;
}

/// What a rollout of N samples and T key frames is given.
template <typename Real>
struct Given {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix conditions;
  std::vector<KeyFrame<Real>> history;
  std::vector<Matrix> objects;  ///< of every key frame
  Matrix noise;                 ///< (NoiseSize (T - k) x N)

  int NumSamples() const { return static_cast<int>(conditions.cols()); }

  template <typename Other>
  Given<Other> Cast() const {
    Given<Other> out;
    out.conditions = conditions.template cast<Other>();
    out.noise = noise.template cast<Other>();
    for (const KeyFrame<Real>& frame : history) {
      out.history.push_back({frame.pose.template cast<Other>(),
                             frame.root.template cast<Other>(),
                             frame.object.template cast<Other>(),
                             {}});
    }
    for (const Matrix& object : objects) out.objects.push_back(object.template cast<Other>());
    return out;
  }
};

inline Given<double> RandomGiven(const Config& config, int samples, int frames,
                                 std::uint64_t seed) {
  nn::RandomStream random(seed);
  const auto draw = [&](Eigen::Index rows) -> Eigen::MatrixXd {
    // Exact in single precision.
    return Eigen::MatrixXd::NullaryExpr(rows, samples, [&] {
      return static_cast<double>(static_cast<float>(2.0 * random.Uniform() - 1.0));
    });
  };
  Given<double> given;
  given.conditions = draw(kNumBetas + kNumObjects + config.action_size);
  for (int f = 0; f < frames; ++f) given.objects.push_back(draw(kObjectSize));
  for (int f = 0; f < kHistory; ++f) {
    given.history.push_back({draw(kPoseSize), draw(3), given.objects[f], {}});
  }
  given.noise = draw(Eigen::Index{config.NoiseSize()} * (frames - kHistory));
  return given;
}

template <typename Real>
void Roll(Rollout<Real>& rollout, const Given<Real>& given, int noise_size) {
  rollout.Begin(given.conditions);
  for (int f = 0; f < kHistory; ++f) {
    const KeyFrame<Real>& frame = given.history[f];
    for (int i = 0; i < given.NumSamples(); ++i) {
      rollout.SetHistory(f, i, frame.pose.col(i), frame.root.col(i), frame.object.col(i));
    }
  }
  for (std::size_t f = kHistory; f < given.objects.size(); ++f) {
    const auto row = static_cast<Eigen::Index>(f - kHistory) * noise_size;
    rollout.Step(given.noise.middleRows(row, noise_size));
    for (int i = 0; i < given.NumSamples(); ++i) {
      rollout.SetObject(i, given.objects[f].col(i));
    }
  }
}

}  // namespace holdfast::imos::testing
