// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/imos/network.h"
#include "generator/nn/column_network.h"
#include "generator/wandr/pose.h"

namespace holdfast::imos {

/// Returns the object of a key frame as network input: T, then rows12 of R (x = R x_object + T) or
/// of its transpose, depending on the configuration.
Eigen::Vector<double, kObjectSize> ObjectColumn(const Eigen::Matrix3d& R, const Eigen::Vector3d& T,
                                                ObjectRotation rotation);
/// Joints 0..21, six numbers each, and the inverse, which orthonormalizes by Gram-Schmidt.
Eigen::Vector<double, kPoseSize> PoseColumn(const wandr::Pose<double>& pose);
wandr::Pose<double> PoseOfColumn(const Eigen::Ref<const Eigen::VectorXd>& column,
                                 const Eigen::Vector3d& root);

/// A key frame of N samples, one column each.
template <typename Real>
struct KeyFrame {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix pose;      ///< (132 x N) joints 0..21, six numbers each, raw network output
  Matrix root;      ///< (3 x N) translation of the root, meters
  Matrix object;    ///< (9 x N) translation, rotation (ObjectColumn)
  Matrix attended;  ///< pose of Body Synthesis after attention; unused without attention
};

/// N samples stepped together through the loop of IMoS (sec. 5.4 of the code). k key frames are
/// given. Every step generates the pose of the next key frame (and its root if predicted) from the
/// past k ones. The object of the next key frame must be set before the next step:
///
///   arms:  mu, sigma = encoder(past arms, past objects, progress, phi);  z = mu + sigma eps
///          arms_t = arms_{t-1} + decoder(phi, z, past arms, past objects, progress)
///   body:  x = [attended past, past, past arms, arms_t, object now, past objects, past roots,
///               progress, phi], parts depending on the configuration
///          mu, sigma = encoder(x);  z = mu + sigma eps;  pose_t = decoder(z, x)
///
/// Raw output is fed back, as published: the six numbers of each rotation are not orthonormalized,
/// so the network has to correct errors in them. A sample's motion does not depend on the other
/// samples in the batch, bit for bit. Allocates only in the constructor.
template <typename Real>
class Rollout {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using ConstRef = Eigen::Ref<const Matrix>;

  /// `network` must outlive the rollout.
  Rollout(const Network<Real>& network, int max_samples, int max_frames);

  /// Sets the conditions (ConditionSize x N) of N samples. Their key frames 0..k-1 must be set
  /// before the first step.
  void Begin(const ConstRef& conditions);
  void SetHistory(int frame, int sample, const Eigen::Ref<const Eigen::Vector<Real, kPoseSize>>& p,
                  const Eigen::Ref<const Eigen::Vector<Real, 3>>& root,
                  const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object);

  /// Generates the next key frame; `noise` (NoiseSize x N) ~ N(0, I) are the eps.
  void Step(const ConstRef& noise);
  /// Sets the object (ObjectColumn) of the latest key frame for one sample.
  void SetObject(int sample, const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object);
  /// Sets its root, if roots are given and not predicted. (Such networks do not use the root.)
  void SetRoot(int sample, const Eigen::Ref<const Eigen::Vector<Real, 3>>& root);

  /// Columns beyond N are undefined.
  const KeyFrame<Real>& Frame(int frame) const { return frames_[frame]; }

 private:
  using Past = std::span<const KeyFrame<Real>, kHistory>;  // oldest first

  void RunArms(Past past, const ConstRef& noise, KeyFrame<Real>& next);
  void RunBody(Past past, const ConstRef& noise, KeyFrame<Real>& next);

  const Network<Real>& network_;
  int max_samples_;
  int num_samples_ = 0;
  int num_frames_ = 0;  // given and generated since Begin
  int num_attended_ = 0;
  std::vector<KeyFrame<Real>> frames_;
  std::optional<nn::Tape<Real>> arms_condition_, arms_encoder_, arms_decoder_;  // of two modules
  nn::Tape<Real> body_condition_, body_encoder_, body_decoder_;
};

extern template class Rollout<float>;
extern template class Rollout<double>;

}  // namespace holdfast::imos
