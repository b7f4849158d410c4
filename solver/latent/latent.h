// SPDX-License-Identifier: MIT
#pragma once

/// Reaches by optimization of latents. A WANDR network, starts and goals of the right wrist go in;
/// latents, the motions rolled out from them and traces of the optimization come out.
///
/// From the inside out:
///   lbfgs_memory.h           curvature from the last steps
///   step_rule.h              Adam, L-BFGS with step 1
///   dual_gauss_newton.h      a step for few residuals, many latents
///   motion_objective.h       Ceres terms over a motion, and gradient
///   goal_objective.h         "VAE + opt": goal and prior alone
///   reach_task.h             start, goal, deadline; solution and trace
///   latent_options.h         weights, body, obstacles
///   latent_terms.h           terms for goal and natural motion
///   latent_problem.h         latents to motion, gradients back
///   latent_optimizer.h       OptimiseLatents: all terms
///   motion_cost.h            the terms that tell good motions of many from bad ones
///   vae_opt.h                OptimiseAsPublished: WANDR's baseline
///   reach_by_optimisation.h  ReachByOptimisation: goals one after another
#include "solver/latent/latent_optimizer.h"
#include "solver/latent/reach_by_optimisation.h"
#include "solver/latent/vae_opt.h"
