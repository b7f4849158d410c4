// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/rollout.h"

namespace holdfast::wandr {

/// One motion, frames 0..T at 30 fps.
struct RolloutTrack {
  StateMatrix<float> states;  ///< (135 x T+1)
  Eigen::MatrixXf joints;     ///< (66 x T+1), world, metres
};

struct RolloutRequest {
  std::span<const RolloutStart<float>> starts;
  std::span<const GoalPlan> plans;  ///< as many as starts
  int num_steps = 240;              ///< T
  /// z_t ~ N(0, sigma^2 I) per motion and step. Motion i draws from stream `first_stream` + i of
  /// `seed`: a part of a larger job gives what the whole gives.
  std::uint64_t seed = 0;
  std::uint64_t first_stream = 0;
  double sigma = 1.0;
  /// Latents given instead, (64 T x N); must outlive the run.
  const Eigen::MatrixXf* latents = nullptr;
};

/// The latents (64 T) that motion `stream` of `seed` draws.
Eigen::VectorXf DrawLatents(std::uint64_t seed, std::uint64_t stream, int latent_size,
                            int num_steps, double sigma);

/// Runs N motions, some dozens at a time in each thread. The result does not depend on `threads`,
/// nor, per motion, on the others. Throws Error for unequal numbers, no motions, no steps, and
/// goals or starts that are not finite.
std::vector<RolloutTrack> RunRollouts(const Network<float>& network,
                                      const BoneOffsets<float>& bones,
                                      const RolloutRequest& request, int threads,
                                      const RolloutOptions& options = {});

/// The same without keeping them: `take(i, track)` is called once for each, from any thread,
/// several at a time; `track` is reused after it returns.
void RunRollouts(const Network<float>& network, const BoneOffsets<float>& bones,
                 const RolloutRequest& request, int threads, const RolloutOptions& options,
                 const std::function<void(int, const RolloutTrack&)>& take);

}  // namespace holdfast::wandr
