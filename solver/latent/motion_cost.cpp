// SPDX-License-Identifier: MIT
#include "solver/latent/motion_cost.h"

#include <vector>

#include "solver/latent/latent_terms.h"

namespace holdfast {
namespace {

// The refit pins feet, keeps them on the ground and balances standing bodies; timing and position
// are the network's choice.
LatentOptions LeftByRefit() {
  LatentOptions options;
  options.skate = options.creep = options.floor = options.airborne = options.balance = 0.0;
  options.path = options.near = options.look = 0.0;
  return options;
}

}  // namespace

double MotionCost(const LatentBody& body, std::span<const Eigen::Vector3d> goals,
                  const wandr::ReachSample& sample) {
  const LatentOptions options = LeftByRefit();
  const auto bones = body.bones.Cast<double>();
  const std::vector<BodyPoint> points = PointsOf(body);
  double sum = 0.0;
  int frames = 0;
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& outcome = sample.goals[g];
    const int first = outcome.taken_on, steps = outcome.left - first;
    if (first < 0 || steps < 1) continue;
    ReachTask task;
    task.goal = goals[g];
    task.num_steps = steps;
    task.deadline = outcome.due - first;
    MotionView motion(points);
    motion.Resize(steps + 1);
    for (int t = 0; t <= steps; ++t) {
      motion.Set(t, wandr::PoseOf<float>(sample.track.states.col(first + t)), bones);
    }
    MotionObjective objective;
    AddNaturalTerms(body, options, motion, task, objective);
    sum += objective.Evaluate(motion);
    frames += steps;
  }
  return frames > 0 ? sum / frames : 0.0;
}

}  // namespace holdfast
