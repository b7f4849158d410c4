// SPDX-License-Identifier: MIT
#pragma once

/// Reaches by optimization of latents. A WANDR network, starts and goals of the right wrist go in;
/// latents, the motions rolled out from them and traces of the optimization come out.
///
/// From the inside out:
///   motion_objective.h       Ceres terms over a motion, and gradient
///   reach_task.h             start, goal, deadline; solution and trace
///   rollout_batch.h          rollouts of many solvers in one pass
///   rollout_cost.h           the cost function through a rollout
///   step_rule.h              published baselines: Adam, L-BFGS with step 1
///   latent_solve.h           LatentProblem: cost and priors, minimized by Ceres
///   latent_options.h         weights, body, obstacles
///   latent_terms.h           terms for goal and natural motion
///   latent_optimizer.h       OptimiseLatents: all terms
///   motion_cost.h            the terms that tell good motions of many from bad ones
///   vae_opt.h                OptimiseAsPublished: WANDR's baseline
///   reach_by_optimisation.h  ReachByOptimisation: goals one after another
#include "solver/latent/latent_optimizer.h"
#include "solver/latent/reach_by_optimisation.h"
#include "solver/latent/vae_opt.h"
