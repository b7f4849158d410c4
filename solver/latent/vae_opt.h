// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "generator/wandr/network.h"
#include "solver/latent/latent_options.h"

namespace holdfast {

/// Optimizer of the latents of "VAE + opt". The paper does not specify it; its released code has
/// presets for L-BFGS (step 1, no line search) and for a learning rate that decays linearly to a
/// tenth. These two follow the release; the others solve the same problem with Ceres.
enum class VaeOptMethod {
  kLm,            ///< Levenberg-Marquardt on the goal's three residuals and the prior
  kLbfgs,         ///< L-BFGS with a line search for the strong Wolfe conditions
  kLbfgsStepOne,  ///< the preset: full steps (LbfgsStepOne)
  kAdam,          ///< with a decaying learning rate (Adam)
};
/// "lm", "lbfgs", "lbfgs-step1", "adam". Throws std::invalid_argument for other names.
VaeOptMethod VaeOptMethodByName(std::string_view name);

/// "VAE + opt", the baseline of WANDR (Diomataris et al. 2024, sec. 4 and table 2): a rollout from
/// random latents, unaware of the goal, which are then optimized to reach it:
///   F(z) = |W_T - G|^2 / (2 sigma_g^2) + lambda/2 sum_t |z_t|^2,
/// where W_T is the right wrist in the last frame, G the goal (meters, world). The paper only
/// states that its distance is minimized; square, last frame and prior are one interpretation.
struct VaeOptOptions {
  VaeOptMethod method = VaeOptMethod::kLm;
  int iterations = 0;         ///< 0: default of NumIterations
  double goal_sigma_m = 1.0;  ///< sigma_g
  /// lambda, per latent. Determines the final distance of a good optimizer: on 24 goals, L-BFGS
  /// with a line search reached 6 cm on average with 1e-4, 1 cm with 1e-6.
  double prior_weight = 1e-6;
  double sigma = 1.0;                     ///< of the initial latents
  int history = 10;                       ///< L-BFGS history
  double learning_rate = 0.05;            ///< initial rate of Adam
  double last_learning_rate_ratio = 0.1;  ///< at the last iteration, decaying linearly
  /// Called before each pass through the network, from several threads; its exceptions end the run.
  std::function<void()> poll = {};

  /// Default: 40 for kLm, 80 for kLbfgsStepOne, else 200: beyond 200 (80 without line search) no
  /// more goals came within reach (without it more never do; with it 62 % after 80, 92 % from 150
  /// on).
  int NumIterations() const;
  /// Throws Error naming the invalid field.
  void Check() const;
};

/// Returns solutions in the order of the tasks. Each is the last iterate, as in the published loop,
/// even if an earlier one was closer (step-1 L-BFGS wanders); a non-finite iterate ends its task at
/// the previous one. The objective uses the last frame of a task, not its deadline. Only the
/// trace's seconds depend on `threads` and on other tasks. Throws Error for invalid options, and
/// for tasks that have no step or are not finite.
std::vector<ReachSolution> OptimizeAsPublished(const wandr::Network<float>& network,
                                               const wandr::BoneOffsets<float>& bones,
                                               std::span<const ReachTask> tasks,
                                               const VaeOptOptions& options, int threads);

}  // namespace holdfast
