// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/action_sequence.h"
#include "generator/imos/rollout.h"

namespace holdfast::imos {

/// Where one sample starts: its first k key frames, in the networks' frame (canonical), meters.
struct SynthesisStart {
  Eigen::Matrix<double, kPoseSize, kHistory> poses;      ///< PoseColumn
  Eigen::Matrix<double, 3, kHistory> roots;              ///< SMPL-X translation
  Eigen::Matrix<double, kObjectSize, kHistory> objects;  ///< ObjectColumn
  Eigen::VectorXf condition;                             ///< ConditionOf
};

/// The first k key frames of a sequence, with its own intent and shape.
SynthesisStart StartOf(const ActionSequence& sequence, ObjectRotation rotation,
                       const Eigen::Ref<const Eigen::MatrixXf>& action_table);

/// One sample's key frames 0..T-1.
struct SynthesisTrack {
  Eigen::MatrixXd raw_poses;  ///< (132 x T) as the networks gave them
  Eigen::MatrixXd poses;      ///< (132 x T) each six numbers a rotation
  Eigen::Matrix3Xd roots;     ///< (3 x T)
  Eigen::MatrixXd objects;    ///< (9 x T) given and answered

  wandr::Pose<double> Pose(int frame) const {
    return PoseOfColumn(poses.col(frame), roots.col(frame));
  }
};

/// Answers where the object is (ObjectColumn) in key frame `frame`, just made, of a sample: its
/// pose is made orthonormal. Called once for each frame in order, of different samples from several
/// threads at a time.
using ObjectOfFrame = std::function<Eigen::Vector<double, kObjectSize>(
    int sample, int frame, const wandr::Pose<double>& pose)>;

struct SynthesisRequest {
  std::span<const SynthesisStart> starts;
  int num_frames = kNumKeyFrames;  ///< T, with the k given ones
  /// eps ~ N(0, sigma^2 I) per sample and step. Sample i draws from stream `first_stream` + i of
  /// `seed`: a part of a larger job gives what the whole gives.
  std::uint64_t seed = 0;
  std::uint64_t first_stream = 0;
  double sigma = 1.0;
  /// eps given instead, (NoiseSize (T - k) x N); must outlive the run.
  const Eigen::MatrixXf* noise = nullptr;
  /// (3 x T) of each sample, for networks whose roots are given; without, the last one stays.
  std::span<const Eigen::Matrix3Xd> roots = {};
};

/// The eps (NoiseSize x steps, below each other) that sample `stream` of `seed` draws.
Eigen::VectorXf DrawNoise(std::uint64_t seed, std::uint64_t stream, int noise_size, int num_steps,
                          double sigma);

/// Runs N samples through the loop, some dozens at a time in each thread. Results do not depend on
/// `threads`, nor, per sample, on the others. Throws Error for unequal numbers and for starts and
/// answers that are not finite; what `object` throws passes through.
std::vector<SynthesisTrack> RunSynthesis(const Network<float>& network,
                                         const SynthesisRequest& request,
                                         const ObjectOfFrame& object, int threads);

}  // namespace holdfast::imos
