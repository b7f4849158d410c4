// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/imos/step.h"
#include "generator/wandr/pose.h"

namespace holdfast::imos {

/// The object of a key frame as the networks see it: T, then rows12 of R (x = R x_object + T) or of
/// its transpose, by the configuration.
Eigen::Vector<double, kObjectSize> ObjectColumn(const Eigen::Matrix3d& R, const Eigen::Vector3d& T,
                                                ObjectRotation rotation);
/// Joints 0..21, six numbers each, and back: every six made a rotation by Gram-Schmidt.
Eigen::Vector<double, kPoseSize> PoseColumn(const wandr::Pose<double>& pose);
wandr::Pose<double> PoseOfColumn(const Eigen::Ref<const Eigen::VectorXd>& column,
                                 const Eigen::Vector3d& root);

/// Gradients of a scalar (or of rows of a residual) with respect to what a rollout made. Each is
/// empty, or has an entry per key frame, of which any may be empty (zero). Columns: m to each
/// sample, consecutive.
template <typename Real>
struct RolloutSeed {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  std::vector<Matrix> poses;  ///< (132 x N m), with respect to raw poses
  std::vector<Matrix> roots;  ///< (3 x N m)
};

/// Gradients with respect to what a rollout of S steps starts from and is given.
template <typename Real>
struct RolloutGradient {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix noise;                         ///< (NoiseSize S x N m), step s in rows NoiseSize s ..
  Matrix condition;                     ///< (ConditionSize x N m)
  std::vector<KeyFrame<Real>> history;  ///< the k given ones: pose, root; its object is below
  std::vector<Matrix> objects;          ///< (9 x N m) of each key frame, poses of others held
};

/// N samples stepped together through the loop of IMoS (sec. 5.4 of the code): k key frames are
/// given; every step makes the pose of the next one; then its object must be set before another
/// step can be taken. What is fed back is raw, as published: the six numbers of every rotation as
/// the networks gave them, not made orthonormal, so that errors there are the network's to correct.
/// A sample's motion does not depend, to the last bit, on which others are in the batch. After
/// construction nothing is allocated but by Backward.
template <typename Real>
class Rollout {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using ConstRef = Eigen::Ref<const Matrix>;

  /// `network` must outlive it. A differentiable one keeps what Backward needs, and its network
  /// must be.
  Rollout(const Network<Real>& network, int max_samples, int max_frames,
          bool differentiable = false);

  /// Key frames 0..k-1 of N samples and their conditions (ConditionSize x N).
  void Begin(const ConstRef& conditions, std::span<const KeyFrame<Real>, kHistory> history);
  /// The same, key frame by key frame; `history` must be complete before the first step.
  void Begin(const ConstRef& conditions);
  void SetHistory(int frame, int sample, const Eigen::Ref<const Eigen::Vector<Real, kPoseSize>>& p,
                  const Eigen::Ref<const Eigen::Vector<Real, 3>>& root,
                  const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object);

  /// Makes key frame NumFrames(); `noise` is (NoiseSize x N).
  void Step(const ConstRef& noise);
  /// Its object (ObjectColumn), of one sample.
  void SetObject(int sample, const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object);
  /// Its root, where that is given and not predicted. (Networks of that kind do not see it.)
  void SetRoot(int sample, const Eigen::Ref<const Eigen::Vector<Real, 3>>& root);

  int NumSamples() const { return num_samples_; }
  int NumFrames() const { return num_frames_; }  ///< given and made since Begin
  /// Columns beyond NumSamples() mean nothing.
  const KeyFrame<Real>& Frame(int frame) const { return frames_[frame]; }

  /// The vector-Jacobian product of all steps taken, exact but at kinks of the rectifiers, objects
  /// held given. `rows` is m.
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
