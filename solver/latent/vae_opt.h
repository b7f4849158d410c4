// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "generator/wandr/network.h"
#include "solver/latent/goal_objective.h"
#include "solver/latent/reach_task.h"

namespace holdfast {

/// "VAE + opt", the baseline of WANDR (Diomataris et al. 2024, sec. 4 and table 2): a rollout from
/// random latents, which are then optimised to bring the wrist to the goal (GoalObjective). How is
/// not published; the released code has a preset for L-BFGS with step 1 and no line search and a
/// schedule that takes a rate linearly to a tenth. Those, and L-BFGS as it should be:
enum class VaeOptMethod {
  kLbfgs,         ///< line search for the strong Wolfe conditions (Ceres)
  kLbfgsStepOne,  ///< the preset: every step whole (LbfgsStepOne)
  kAdam,          ///< with a rate that falls (Adam)
};

struct VaeOptOptions {
  VaeOptMethod method = VaeOptMethod::kLbfgs;
  int iterations = 0;  ///< 0: DefaultIterations
  GoalObjectiveWeights objective;
  double sigma = 1.0;                     ///< of the latents to begin with
  int history = 10;                       ///< steps that L-BFGS remembers
  double learning_rate = 0.05;            ///< Adam's, at first
  double last_learning_rate_ratio = 0.1;  ///< at the last iteration, linearly
  /// Called before each iteration, from several threads; what it throws ends the run.
  std::function<void()> poll = {};

  /// 200, and 80 without line search: where more of them no longer brought more goals within reach
  /// (without line search more never do; with it, 62 % after 80, 92 % from 150 on).
  static int DefaultIterations(VaeOptMethod method);
  /// Throws Error naming the field that makes no sense.
  void Check() const;
};

/// Solutions in the order of the tasks. Each is the last iterate, as the published loop would leave
/// it, even where one before was closer (step-1 L-BFGS wanders); an iterate that is not finite ends
/// its task at the one before. The objective looks at the last frame of a task, never at its
/// deadline. Nothing but the trace's seconds depends on `threads` or on the other tasks. Throws
/// Error for options, and for tasks without a step or that are not finite.
std::vector<ReachSolution> OptimiseAsPublished(const wandr::Network<float>& network,
                                               const wandr::BoneOffsets<float>& bones,
                                               std::span<const ReachTask> tasks,
                                               const VaeOptOptions& options, int threads);

}  // namespace holdfast
