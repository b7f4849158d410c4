// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/imos/step.h"
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

/// Gradients of a scalar (or of rows of a residual) with respect to the output of a rollout. Each
/// member is empty or has one entry per key frame, any of which may be empty (zero). m consecutive
/// columns per sample.
template <typename Real>
struct RolloutSeed {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  std::vector<Matrix> poses;  ///< (132 x N m), with respect to raw poses
  std::vector<Matrix> roots;  ///< (3 x N m)
};

/// Gradients with respect to the inputs of a rollout of S steps.
template <typename Real>
struct RolloutGradient {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix noise;                         ///< (NoiseSize S x N m), step s in rows NoiseSize s ..
  Matrix condition;                     ///< (ConditionSize x N m)
  std::vector<KeyFrame<Real>> history;  ///< pose and root of the k given key frames; their objects
                                        ///< are below
  std::vector<Matrix> objects;          ///< (9 x N m) of each key frame, other object poses fixed
};

/// N samples stepped together through the loop of IMoS (sec. 5.4 of the code). k key frames are
/// given. Every step generates the pose of the next key frame, whose object must be set before the
/// next step. Raw output is fed back, as published: the six numbers of each rotation are not
/// orthonormalized, so the network has to correct errors in them. A sample's motion does not depend
/// on the other samples in the batch, bit for bit. After construction, only Backward allocates.
template <typename Real>
class Rollout {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using ConstRef = Eigen::Ref<const Matrix>;

  /// `network` must outlive the rollout. A differentiable rollout stores what Backward needs, and
  /// requires a differentiable network.
  Rollout(const Network<Real>& network, int max_samples, int max_frames,
          bool differentiable = false);

  /// Sets key frames 0..k-1 of N samples and their conditions (ConditionSize x N).
  void Begin(const ConstRef& conditions, std::span<const KeyFrame<Real>, kHistory> history);
  /// Same, one key frame at a time; `history` must be complete before the first step.
  void Begin(const ConstRef& conditions);
  void SetHistory(int frame, int sample, const Eigen::Ref<const Eigen::Vector<Real, kPoseSize>>& p,
                  const Eigen::Ref<const Eigen::Vector<Real, 3>>& root,
                  const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object);

  /// Generates key frame NumFrames(); `noise` is (NoiseSize x N).
  void Step(const ConstRef& noise);
  /// Sets the object (ObjectColumn) of the latest key frame for one sample.
  void SetObject(int sample, const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object);
  /// Sets its root, if roots are given and not predicted. (Such networks do not use the root.)
  void SetRoot(int sample, const Eigen::Ref<const Eigen::Vector<Real, 3>>& root);

  int NumSamples() const { return num_samples_; }
  int NumFrames() const { return num_frames_; }  ///< given and generated since Begin
  /// Columns beyond NumSamples() are undefined.
  const KeyFrame<Real>& Frame(int frame) const { return frames_[frame]; }

  /// Vector-Jacobian product of all steps, exact except at kinks of the rectifiers, with objects
  /// treated as given. `rows` is m.
  void Backward(const RolloutSeed<Real>& seed, int rows, RolloutGradient<Real>& gradient) const;

 private:
  void RunConditions(const ConstRef& conditions);
  StepTape<Real>& TapeOf(int frame) { return tapes_[differentiable_ ? frame - kHistory : 0]; }

  const Network<Real>& network_;
  int max_samples_;
  bool differentiable_;
  int num_samples_ = 0;
  int num_frames_ = 0;
  int num_attended_ = 0;
  std::vector<KeyFrame<Real>> frames_;
  std::optional<nn::Tape<Real>> arms_condition_, body_condition_;
  ConditionCodes<Real> codes_;
  std::vector<StepTape<Real>> tapes_;                      // one, or one per step
  std::vector<typename Attention<Real>::Tape> attention_;  // one, or none
};

extern template class Rollout<float>;
extern template class Rollout<double>;

}  // namespace holdfast::imos
