// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "generator/imos/action_sequence.h"
#include "generator/imos/rollout.h"
#include "generator/imos/vocabulary.h"
#include "generator/imos/weights.h"

namespace holdfast {

/// Weights of the IMoS generator, their origin, and a summary of the training data.
struct SynthesisNetwork {
  std::string source;  ///< the file, or "embedded"
  imos::NetworkWeights weights;
  std::string checksum;                        ///< identifies the network
  Eigen::MatrixXf action_table;                ///< (29 x E)
  std::map<std::string, double> seconds;       ///< per key frame, by action, mean of the data
  std::map<std::string, nlohmann::json> seen;  ///< by action: objects and their counts

  /// Actions in the training data, in vocabulary order; all if the file does not list them.
  std::vector<std::string> Actions() const;
  /// Mean for the action; if unknown, the mean over all actions, or IMoS's 0.1 s.
  double SecondsPerKeyFrame(int action) const;
  nlohmann::json ToJson() const;
};

/// Reads the weights in a file, or the embedded ones if `path` is empty. Action vectors are read
/// from `vectors` (imos::ReadActionTable) unless it is empty, or the networks have learned vectors
/// of another size. Throws Error if there are none.
SynthesisNetwork LoadSynthesisNetwork(const std::string& path = {},
                                      const std::string& vectors = {});

}  // namespace holdfast

namespace holdfast::imos {

/// Returns whether the library has embedded trained weights (meshes/networks/imos.safetensors).
bool HasDefaultNetwork();

/// Returns the embedded weights. Throws Error if there are none.
NetworkWeights DefaultNetwork();

/// Start of one sample: its first k key frames in the canonical frame, meters.
struct SynthesisStart {
  Eigen::Matrix<double, kPoseSize, kHistory> poses;      ///< PoseColumn
  Eigen::Matrix<double, 3, kHistory> roots;              ///< SMPL-X translation
  Eigen::Matrix<double, kObjectSize, kHistory> objects;  ///< ObjectColumn
  Eigen::VectorXf condition;                             ///< ConditionOf
};

/// Returns the first k key frames of a sequence, with its own intent and shape.
SynthesisStart StartOf(const ActionSequence& sequence, ObjectRotation rotation,
                       const Eigen::Ref<const Eigen::MatrixXf>& action_table);

/// Key frames 0..T-1 of one sample.
struct SynthesisTrack {
  Eigen::MatrixXd raw_poses;  ///< (132 x T) raw network output
  Eigen::MatrixXd poses;      ///< (132 x T) with orthonormalized rotations
  Eigen::Matrix3Xd roots;     ///< (3 x T)
  Eigen::MatrixXd objects;    ///< (9 x T) given objects and those of ObjectOfFrame

  wandr::Pose<double> Pose(int frame) const {
    return PoseOfColumn(poses.col(frame), roots.col(frame));
  }
};

/// Returns the object (ObjectColumn) in the latest key frame `frame` of a sample; `pose` is
/// orthonormalized. Called once per frame in order, concurrently for different samples.
using ObjectOfFrame = std::function<Eigen::Vector<double, kObjectSize>(
    int sample, int frame, const wandr::Pose<double>& pose)>;

struct SynthesisRequest {
  std::span<const SynthesisStart> starts;
  int num_frames = kNumKeyFrames;  ///< T, including the k given key frames
  /// eps ~ N(0, sigma^2 I) per sample and step. Sample i uses stream `first_stream` + i of `seed`,
  /// so a part of a larger job gives the same samples as the whole.
  std::uint64_t seed = 0;
  std::uint64_t first_stream = 0;
  double sigma = 1.0;
  /// Given eps instead of random ones, (NoiseSize (T - k) x N); must outlive the run.
  const Eigen::MatrixXf* noise = nullptr;
  /// (3 x T) per sample, for networks with given roots; if empty, the last root is kept.
  std::span<const Eigen::Matrix3Xd> roots = {};
};

/// Runs N samples in batches of some dozens per thread. The results do not depend on `threads`; a
/// sample does not depend on the others. Throws Error for unequal numbers and for non-finite starts
/// or objects. Exceptions of `object` are passed on.
std::vector<SynthesisTrack> RunSynthesis(const Network<float>& network,
                                         const SynthesisRequest& request,
                                         const ObjectOfFrame& object, int threads);

}  // namespace holdfast::imos
