// SPDX-License-Identifier: MIT
#include "solver/latent/vae_opt.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/latent/latent_solve.h"

namespace holdfast {
namespace {

// Motions per pass over the weights; more would not fit a core's cache with their tapes.
constexpr int kBatch = 16;
// Levenberg-Marquardt stops here: beyond this only the prior would improve.
constexpr double kThere_m = 5e-4;
// It may stall before the wrist reaches the goal; then it restarts from other latents.
constexpr int kLmStarts = 3;
constexpr double kMissed_m = 0.1;
constexpr std::uint64_t kStartsApart = 1'000'000'000'000;

LatentSolve SolveOne(RolloutBatch<float>& batch, int motion, const ReachTask& task,
                     const VaeOptOptions& options, Eigen::VectorXd& latents, ReachTrace& trace) {
  const GoalRows goal{batch.NumSteps(), WristJoint(Side::kRight), task.goal, options.goal_sigma_m};
  // First-order methods need one backward pass instead of three.
  const MotionEnergy energy = [&goal](const MotionView& view, MotionGradient& bar) {
    const Eigen::Vector3d off = (view.At(goal.frame, goal.joint) - goal.place) / goal.sigma_m;
    bar.joints.block<3, 1>(3 * goal.joint, goal.frame) += off / goal.sigma_m;
    return 0.5 * off.squaredNorm();
  };
  const bool by_rows = options.method == VaeOptMethod::kLm;
  RolloutCost<float> cost(batch, motion, MotionView(), by_rows ? std::optional(goal) : std::nullopt,
                          by_rows ? nullptr : energy);
  const IterateSeen seen = [&](int) {
    Record(cost.Motion(), goal.joint, goal.place, batch.Seconds(), trace);
    return by_rows && (cost.Motion().At(goal.frame, goal.joint) - goal.place).norm() < kThere_m;
  };
  const int iterations = options.NumIterations();
  const auto minimize = [&](const ceres::Solver::Options& solver) {
    return MinimizeLatents(cost, Eigen::VectorXd::Zero(latents.size()), options.prior_weight,
                           solver, latents, seen);
  };
  const auto descend = [&](const char* name, const StepRule& rule) {
    return DescendLatents(name, rule, iterations, cost, options.prior_weight, latents, seen);
  };
  switch (options.method) {
    case VaeOptMethod::kLm: {
      ceres::Solver::Options solver = LevenbergMarquardtOptions(iterations, 0.02);
      // Allow temporary increases: fewer distant starts stall before the goal.
      solver.use_nonmonotonic_steps = true;
      return minimize(solver);
    }
    case VaeOptMethod::kLbfgs:
      return minimize(LbfgsOptions(iterations, options.history));
    case VaeOptMethod::kLbfgsStepOne:
      return descend("LBFGS_STEP_ONE", LbfgsStepOne(options.history));
    case VaeOptMethod::kAdam:
      break;
  }
  return descend("ADAM", Adam(options.learning_rate, options.last_learning_rate_ratio, iterations));
}

void CheckTasks(std::span<const ReachTask> tasks) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const ReachTask& task = tasks[i];
    const auto require = [&](bool sound, const char* problem, const char* remedy) {
      if (!sound) throw Error(fmt::format("reach task {}", i), problem, remedy);
    };
    require(task.num_steps >= 1, "it has no step", "Ask for 1 or more");
    require(task.goal.allFinite(), "its goal is not finite", "Give three numbers, meters");
    require(wandr::StateOf(task.start.pose).allFinite() && task.start.previous_delta.allFinite(),
            "its start is not finite", "Check the clip it comes from");
  }
}

// Indices of tasks, in groups of equal number of steps with at most `most` each.
std::vector<std::vector<int>> Groups(std::span<const ReachTask> tasks, int most) {
  std::vector<int> order(tasks.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int i) { return tasks[i].num_steps; });
  std::vector<std::vector<int>> groups;
  for (const int i : order) {
    if (groups.empty() || static_cast<int>(groups.back().size()) == most ||
        tasks[groups.back()[0]].num_steps != tasks[i].num_steps) {
      groups.emplace_back();
    }
    groups.back().push_back(i);
  }
  return groups;
}

}  // namespace

VaeOptMethod VaeOptMethodByName(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, VaeOptMethod>, 4> kNames = {
      {{"lm", VaeOptMethod::kLm},
       {"lbfgs", VaeOptMethod::kLbfgs},
       {"lbfgs-step1", VaeOptMethod::kLbfgsStepOne},
       {"adam", VaeOptMethod::kAdam}}};
  for (const auto& [known, method] : kNames) {
    if (known == name) return method;
  }
  throw std::invalid_argument("unknown latent optimizer: " + std::string(name));
}

int VaeOptOptions::NumIterations() const {
  if (iterations > 0) return iterations;
  if (method == VaeOptMethod::kLm) return 40;
  return method == VaeOptMethod::kLbfgsStepOne ? 80 : 200;
}

void VaeOptOptions::Check() const {
  const auto require = [](bool sound, const char* field, const char* remedy) {
    if (!sound) throw Error(fmt::format("VAE + opt: {}", field), "is out of range", remedy);
  };
  require(iterations >= 0, "iterations", "Give 1 or more, or 0 for the default of the method");
  require(goal_sigma_m > 0.0, "goal_sigma_m", "Give meters above 0");
  require(prior_weight >= 0.0, "prior_weight", "Give 0 or more");
  require(sigma >= 0.0 && sigma < 10.0, "sigma", "Give 0 to 10; training uses 1");
  require(history >= 1, "history", "Give 1 or more steps");
  require(learning_rate > 0.0, "learning_rate", "Give more than 0");
  require(last_learning_rate_ratio >= 0.0, "last_learning_rate_ratio", "Give 0 or more");
}

std::vector<ReachSolution> OptimizeAsPublished(const wandr::Network<float>& network,
                                               const wandr::BoneOffsets<float>& bones,
                                               std::span<const ReachTask> tasks,
                                               const VaeOptOptions& options, int threads) {
  options.Check();
  CheckTasks(tasks);
  const int share = (static_cast<int>(tasks.size()) + threads - 1) / std::max(threads, 1);
  const auto groups = Groups(tasks, std::clamp(share, 1, kBatch));
  std::vector<ReachSolution> solutions(tasks.size());
  ParallelFor(static_cast<int>(groups.size()), threads, [&](int g) {
    const std::vector<int>& group = groups[g];
    const auto count = static_cast<Eigen::Index>(group.size());
    const int steps = tasks[group[0]].num_steps;
    std::vector<wandr::RolloutStart<float>> starts;
    for (const int i : group) starts.push_back(tasks[i].start);
    const std::vector<wandr::GoalPlan> no_plans(group.size());
    RolloutBatch<float> batch(network, bones, {}, starts, no_plans, steps, options.poll);
    Eigen::MatrixXf all(Eigen::Index{network.LatentSize()} * steps, count);
    batch.Solve([&](int k) {
      const ReachTask& task = tasks[group[k]];
      ReachSolution& solution = solutions[group[k]];
      const int starts_tried = options.method == VaeOptMethod::kLm ? kLmStarts : 1;
      for (int start = 0; start < starts_tried; ++start) {
        Eigen::VectorXd latents = wandr::DrawLatents(task.seed, task.stream + kStartsApart * start,
                                                     network.LatentSize(), steps, options.sigma)
                                      .cast<double>();
        solution.solves.push_back(SolveOne(batch, k, task, options, latents, solution.trace));
        solution.latents = latents.cast<float>();
        if (!solution.trace.last_m.empty() && solution.trace.last_m.back() <= kMissed_m) break;
      }
      all.col(k) = solution.latents;
    });
    wandr::RolloutRequest request;
    request.starts = starts;
    request.plans = no_plans;
    request.num_steps = steps;
    request.latents = &all;
    std::vector<wandr::RolloutTrack> tracks = wandr::RunRollouts(network, bones, request, 1);
    for (Eigen::Index k = 0; k < count; ++k) {
      solutions[group[k]].track = std::move(tracks[k]);
    }
  });
  return solutions;
}

}  // namespace holdfast
