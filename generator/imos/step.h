// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "generator/imos/network.h"
#include "generator/nn/column_network.h"

namespace holdfast::imos {

/// A key frame of N samples, one column each, or gradients with respect to it.
template <typename Real>
struct KeyFrame {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix pose;      ///< (132 x N) joints 0..21, six numbers each, raw network output
  Matrix root;      ///< (3 x N) translation of the root, meters
  Matrix object;    ///< (9 x N) translation, rotation (ObjectColumn)
  Matrix attended;  ///< pose of Body Synthesis after attention; unused without attention

  void Resize(const Config& config, int columns);
  void SetZero();
};

/// phi of both modules, (arms_condition x N) and (body_condition x N).
template <typename Real>
struct ConditionCodes {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix arms, body;
};

/// Buffers for one step of up to `max_samples` samples. The backward pass reads them.
template <typename Real>
class StepTape {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  StepTape(const Network<Real>& network, int max_samples);
  void Resize(int num_samples);

  std::optional<nn::Tape<Real>> arms_encoder, arms_decoder;  ///< with two modules only
  std::optional<nn::Tape<Real>> body_encoder, body_decoder;  ///< always
  Matrix noise;                                              ///< (NoiseSize x max samples)
  Real progress = 0;                                         ///< ProgressOf
};

/// Buffers for StepBackward with up to `max_gradients` columns.
template <typename Real>
class StepScratch {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  StepScratch(const Network<Real>& network, int max_gradients);

  std::optional<nn::Scratch<Real>> arms_encoder, arms_decoder, body_encoder, body_decoder;
  Matrix output_bar, code_bar, encoder_input_bar, decoder_input_bar, arms_bar;
};

/// Computes one step: the pose of the next key frame (and its root if predicted) from the past k
/// key frames, oldest first, with their `attended`. Writes next.pose and next.root; does not
/// allocate. `frame` is the index of the next key frame. `noise` (NoiseSize x N) ~ N(0, I): the
/// latents are mu + sigma noise.
///
///   arms:  mu, sigma = encoder(past arms, past objects, progress, phi);  z = mu + sigma eps
///          arms_t = arms_{t-1} + decoder(phi, z, past arms, past objects, progress)
///   body:  x = [attended past, past, past arms, arms_t, object now, past objects, past roots,
///               progress, phi], parts depending on the configuration
///          mu, sigma = encoder(x);  z = mu + sigma eps;  pose_t = decoder(z, x)
template <typename Real>
void RunStep(const Network<Real>& network, std::span<const KeyFrame<Real>, kHistory> past,
             const ConditionCodes<Real>& codes, int frame,
             const Eigen::Ref<const typename KeyFrame<Real>::Matrix>& noise, StepTape<Real>& tape,
             KeyFrame<Real>& next);

/// Vector-Jacobian product of RunStep. Gradients have `rows` consecutive columns per sample. Adds
/// to `past_bar` (with respect to pose, root, object and attended) and `codes_bar`; writes
/// `noise_bar`.
template <typename Real>
void StepBackward(const Network<Real>& network, const StepTape<Real>& tape,
                  const KeyFrame<Real>& next_bar, int rows,
                  std::span<KeyFrame<Real>, kHistory> past_bar, ConditionCodes<Real>& codes_bar,
                  Eigen::Ref<typename KeyFrame<Real>::Matrix> noise_bar,
                  StepScratch<Real>& scratch);

}  // namespace holdfast::imos
