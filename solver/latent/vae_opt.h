// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "generator/wandr/network.h"
#include "solver/latent/latent_options.h"

namespace holdfast {

/// How the latents of "VAE + opt" are optimized. The paper does not say; its released code has a
/// preset for L-BFGS with step 1 and no line search, and a schedule that takes a rate linearly to a
/// tenth. Those two are as released, the others as Ceres solves the same problem.
enum class VaeOptMethod {
  kLm,            ///< Levenberg-Marquardt on the goal's three residuals and the prior
  kLbfgs,         ///< L-BFGS, line search for the strong Wolfe conditions
  kLbfgsStepOne,  ///< the preset: every step whole (LbfgsStepOne)
  kAdam,          ///< with a rate that falls (Adam)
};
/// "lm", "lbfgs", "lbfgs-step1", "adam". Throws std::invalid_argument for any other.
VaeOptMethod VaeOptMethodByName(std::string_view name);

/// "VAE + opt", the baseline of WANDR (Diomataris et al. 2024, sec. 4 and table 2): a rollout from
/// random latents, blind to the goal, which are then optimized to bring the wrist there:
///   F(z) = |W_T - G|^2 / (2 sigma_g^2) + lambda/2 sum_t |z_t|^2,
/// W_T the right wrist in the last frame, G the goal (meters, world). Only that the wrist's
/// distance is minimized is published; square, last frame and the prior are one reading of it.
struct VaeOptOptions {
  VaeOptMethod method = VaeOptMethod::kLm;
  int iterations = 0;         ///< 0: DefaultIterations
  double goal_sigma_m = 1.0;  ///< sigma_g
  /// lambda, per latent. It decides how near a good optimizer ends: of 24 goals, L-BFGS with a line
  /// search came within 6 cm on average with 1e-4, within 1 cm with 1e-6.
  double prior_weight = 1e-6;
  double sigma = 1.0;                     ///< of the latents to begin with
  int history = 10;                       ///< steps that L-BFGS remembers
  double learning_rate = 0.05;            ///< Adam's, at first
  double last_learning_rate_ratio = 0.1;  ///< at the last iteration, linearly
  /// Called before each pass through the network, from several threads; what it throws ends the
  /// run.
  std::function<void()> poll = {};

  /// 200, and 80 without line search: where more of them no longer brought more goals within reach
  /// (without line search more never do; with it, 62 % after 80, 92 % from 150 on).
  static int DefaultIterations(VaeOptMethod method);
  int NumIterations() const { return iterations > 0 ? iterations : DefaultIterations(method); }
  /// Throws Error naming the field that makes no sense.
  void Check() const;
};

/// Solutions in the order of the tasks. Each is the last iterate, as the published loop would leave
/// it, even where one before was closer (step-1 L-BFGS wanders); an iterate that is not finite ends
/// its task at the one before. The objective looks at the last frame of a task, never at its
/// deadline. Nothing but the trace's seconds depends on `threads` or on the other tasks. Throws
/// Error for options, and for tasks without a step or that are not finite.
std::vector<ReachSolution> OptimizeAsPublished(const wandr::Network<float>& network,
                                               const wandr::BoneOffsets<float>& bones,
                                               std::span<const ReachTask> tasks,
                                               const VaeOptOptions& options, int threads);

}  // namespace holdfast
