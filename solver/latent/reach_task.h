// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/rollout.h"
#include "generator/wandr/run_rollouts.h"

namespace holdfast {

/// A motion that is wanted: from a start, its wrist at a goal. The wrist is the right one (see
/// wandr::MirroredStates for the left).
struct ReachTask {
  wandr::RolloutStart<float> start;
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();  ///< world, metres
  int num_steps = 239;                             ///< T: frames 0..T at 30 fps
  int deadline = 239;                              ///< frame at which the wrist is due
  /// The optimisation begins with the latents that wandr::DrawLatents gives this stream.
  std::uint64_t seed = 1;
  std::uint64_t stream = 0;
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< of the pelvis at the start, m/s
};

/// How an optimisation went: one entry per iterate, the first before any step.
struct ReachTrace {
  std::vector<float> closest_m;  ///< least distance of wrist and goal over all frames
  std::vector<float> last_m;     ///< distance at the last frame
  std::vector<float> seconds;    ///< of the whole batch so far, by its size
};

/// How one minimization went, in Ceres' words.
struct LatentSolve {
  std::string minimizer;      ///< "LEVENBERG_MARQUARDT", "LBFGS", ..; "ADAM" is no Ceres minimizer
  std::string linear_solver;  ///< "CGNR"; empty without one
  int iterations = 0;
  std::string termination;  ///< "CONVERGENCE", "NO_CONVERGENCE", ..
};

struct ReachSolution {
  wandr::RolloutTrack track;
  Eigen::VectorXf latents;  ///< (64 T)
  ReachTrace trace;
  std::vector<LatentSolve> solves;  ///< one after another
};

}  // namespace holdfast
