// SPDX-License-Identifier: MIT
#include "solver/latent/vae_opt.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <memory>
#include <numeric>

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/latent/step_rule.h"

namespace holdfast {
namespace {

using Objective = GoalObjective<float>;

// Motions that share the reading of weights; more would not fit a core's cache with their tapes.
constexpr int kBatch = 16;

// Tasks of the same number of steps, and what becomes of them.
struct TaskBatch {
  std::vector<wandr::RolloutStart<float>> starts;
  std::vector<Eigen::Vector3d> goals;
  Eigen::MatrixXf latents;  // (64 T x N)
  std::vector<ReachTrace> traces;
};

class MotionTimer {
 public:
  explicit MotionTimer(std::size_t motions) : motions_(static_cast<double>(motions)) {}
  float Seconds() const {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin_;
    return static_cast<float>(passed.count() / motions_);
  }

 private:
  double motions_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

void Append(ReachTrace& trace, double closest_m, double last_m, float seconds) {
  trace.closest_m.push_back(static_cast<float>(closest_m));
  trace.last_m.push_back(static_cast<float>(last_m));
  trace.seconds.push_back(seconds);
}

// All motions of a batch together, each for as long as its numbers are finite.
template <typename MakeRule>
void StepTogether(Objective& objective, TaskBatch& batch, int iterations,
                  const std::function<void()>& poll, const MakeRule& make_rule) {
  const MotionTimer clock(batch.starts.size());
  std::vector<int> going(batch.starts.size());
  std::iota(going.begin(), going.end(), 0);
  std::vector<std::unique_ptr<StepRule>> rules;
  for (std::size_t i = 0; i < going.size(); ++i) rules.push_back(make_rule());
  Eigen::MatrixXf latents = batch.latents, gradient;  // of those that are going
  Objective::Values values;
  for (int iteration = 0; iteration <= iterations && !going.empty(); ++iteration) {
    if (poll) poll();
    std::vector<wandr::RolloutStart<float>> starts;
    std::vector<Eigen::Vector3d> goals;
    for (const int i : going) {
      starts.push_back(batch.starts[i]);
      goals.push_back(batch.goals[i]);
    }
    const bool last = iteration == iterations;
    objective.Evaluate(starts, goals, latents, values, last ? nullptr : &gradient);
    const float seconds = clock.Seconds();
    int kept = 0;
    for (int k = 0; k < static_cast<int>(going.size()); ++k) {
      if (!std::isfinite(values.value[k])) continue;  // stays at the iterate before
      const int i = going[k];
      batch.latents.col(i) = latents.col(k);
      Append(batch.traces[i], values.closest_m[k], values.last_m[k], seconds);
      if (last || !gradient.col(k).allFinite()) continue;
      latents.col(kept) = latents.col(k);
      if (!rules[i]->Step(iteration, gradient.col(k), latents.col(kept))) continue;
      going[kept++] = i;
    }
    going.resize(kept);
    latents.conservativeResize(Eigen::NoChange, kept);
  }
}

// One motion as Ceres sees it. What `poll` throws must not pass through Ceres: it is kept.
class CeresGoal final : public ceres::FirstOrderFunction {
 public:
  CeresGoal(Objective& objective, const TaskBatch& batch) : objective_(objective), batch_(batch) {}

  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    objective_.Evaluate(
        batch_.starts, batch_.goals,
        Eigen::Map<const Eigen::VectorXd>(parameters, NumParameters()).cast<float>(), values_,
        gradient ? &gradient_ : nullptr);
    *cost = values_.value[0];
    if (gradient) {
      Eigen::Map<Eigen::VectorXd>(gradient, NumParameters()) = gradient_.col(0).cast<double>();
    }
    return std::isfinite(*cost) && (!gradient || gradient_.allFinite());
  }
  int NumParameters() const override { return static_cast<int>(batch_.latents.rows()); }

  const Objective::Values& Latest() const { return values_; }

 private:
  Objective& objective_;
  const TaskBatch& batch_;
  mutable Objective::Values values_;
  mutable Eigen::MatrixXf gradient_;
};

class CeresWatch final : public ceres::IterationCallback {
 public:
  CeresWatch(const CeresGoal& goal, const Eigen::VectorXd& parameters, ReachTrace& trace,
             const std::function<void()>& poll)
      : goal_(goal), parameters_(parameters), trace_(trace), poll_(poll) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    // The line search may have looked further than the point that it took.
    double cost = goal_.Latest().value[0];
    if (cost != summary.cost) goal_.Evaluate(parameters_.data(), &cost, nullptr);
    Append(trace_, goal_.Latest().closest_m[0], goal_.Latest().last_m[0], clock_.Seconds());
    try {
      if (poll_) poll_();
    } catch (...) {
      stopped_by_ = std::current_exception();
      return ceres::SOLVER_ABORT;
    }
    return ceres::SOLVER_CONTINUE;
  }
  void Rethrow() const {
    if (stopped_by_) std::rethrow_exception(stopped_by_);
  }

 private:
  const CeresGoal& goal_;
  const Eigen::VectorXd& parameters_;
  ReachTrace& trace_;
  const std::function<void()>& poll_;
  MotionTimer clock_{1};
  std::exception_ptr stopped_by_;
};

void SolveWithCeres(Objective& objective, TaskBatch& batch, int iterations,
                    const VaeOptOptions& options) {
  Eigen::VectorXd parameters = batch.latents.col(0).cast<double>();
  auto* const goal = new CeresGoal(objective, batch);
  const ceres::GradientProblem problem(goal);  // owns it
  CeresWatch watch(*goal, parameters, batch.traces[0], options.poll);
  ceres::GradientProblemSolver::Options ceres_options;
  ceres_options.line_search_direction_type = ceres::LBFGS;
  ceres_options.line_search_type = ceres::WOLFE;
  ceres_options.max_lbfgs_rank = options.history;
  ceres_options.max_num_iterations = iterations;
  // It goes on for as long as the line search finds anything: the others have no such test either.
  ceres_options.function_tolerance = 0.0;
  ceres_options.gradient_tolerance = 1e-7;
  ceres_options.parameter_tolerance = 0.0;
  ceres_options.logging_type = ceres::SILENT;
  ceres_options.update_state_every_iteration = true;
  ceres_options.callbacks.push_back(&watch);
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(ceres_options, problem, parameters.data(), &summary);
  watch.Rethrow();
  batch.latents.col(0) = parameters.cast<float>();
}

void CheckTasks(std::span<const ReachTask> tasks) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const ReachTask& task = tasks[i];
    const auto require = [&](bool sound, const char* problem, const char* remedy) {
      if (!sound) throw Error(fmt::format("reach task {}", i), problem, remedy);
    };
    require(task.num_steps >= 1, "it has no step", "Ask for 1 or more");
    require(task.goal.allFinite(), "its goal is not finite", "Give three numbers, metres");
    require(wandr::StateOf(task.start.pose).allFinite() && task.start.previous_delta.allFinite(),
            "its start is not finite", "Check the clip it comes from");
  }
}

// Indices of tasks, in groups of the same number of steps and at most `most` each.
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

int VaeOptOptions::DefaultIterations(VaeOptMethod method) {
  return method == VaeOptMethod::kLbfgsStepOne ? 80 : 200;
}

void VaeOptOptions::Check() const {
  const auto require = [](bool sound, const char* field, const char* remedy) {
    if (!sound) throw Error(fmt::format("VAE + opt: {}", field), "makes no sense", remedy);
  };
  require(iterations >= 0, "iterations", "Give 1 or more, or 0 for the method's own");
  require(objective.goal_sigma_m > 0.0, "goal_sigma_m", "Give metres above 0");
  require(objective.prior_weight >= 0.0, "prior_weight", "Give 0 or more");
  require(sigma >= 0.0 && sigma < 10.0, "sigma", "Give 0 to 10; training has 1");
  require(history >= 1, "history", "Give 1 or more steps");
  require(learning_rate > 0.0, "learning_rate", "Give more than 0");
  require(last_learning_rate_ratio >= 0.0, "last_learning_rate_ratio", "Give 0 or more");
}

std::vector<ReachSolution> OptimiseAsPublished(const wandr::Network<float>& network,
                                               const wandr::BoneOffsets<float>& bones,
                                               std::span<const ReachTask> tasks,
                                               const VaeOptOptions& options, int threads) {
  options.Check();
  CheckTasks(tasks);
  const int iterations = options.iterations > 0 ? options.iterations
                                                : VaeOptOptions::DefaultIterations(options.method);
  const int share = (static_cast<int>(tasks.size()) + threads - 1) / std::max(threads, 1);
  const bool alone = options.method == VaeOptMethod::kLbfgs;  // each line search has its own steps
  const auto groups = Groups(tasks, alone ? 1 : std::clamp(share, 1, kBatch));
  std::vector<ReachSolution> solutions(tasks.size());
  ParallelFor(static_cast<int>(groups.size()), threads, [&](int g) {
    const std::vector<int>& group = groups[g];
    const int count = static_cast<int>(group.size()), steps = tasks[group[0]].num_steps;
    TaskBatch batch;
    batch.traces.resize(count);
    batch.latents.resize(Eigen::Index{network.LatentSize()} * steps, count);
    for (int k = 0; k < count; ++k) {
      const ReachTask& task = tasks[group[k]];
      batch.starts.push_back(task.start);
      batch.goals.push_back(task.goal);
      batch.latents.col(k) =
          wandr::DrawLatents(task.seed, task.stream, network.LatentSize(), steps, options.sigma);
    }
    const AdamRates rates{options.learning_rate, options.last_learning_rate_ratio, iterations};
    Objective objective(network, bones, count, steps, options.objective);
    switch (options.method) {
      case VaeOptMethod::kLbfgs:
        SolveWithCeres(objective, batch, iterations, options);
        break;
      case VaeOptMethod::kLbfgsStepOne:
        StepTogether(objective, batch, iterations, options.poll,
                     [&] { return std::make_unique<LbfgsStepOne>(options.history); });
        break;
      case VaeOptMethod::kAdam:
        StepTogether(objective, batch, iterations, options.poll,
                     [&] { return std::make_unique<Adam>(rates); });
        break;
    }
    const std::vector<wandr::GoalPlan> no_plans(count);
    wandr::RolloutRequest request;
    request.starts = batch.starts;
    request.plans = no_plans;
    request.num_steps = steps;
    request.latents = &batch.latents;
    std::vector<wandr::RolloutTrack> tracks = wandr::RunRollouts(network, bones, request, 1);
    for (int k = 0; k < count; ++k) {
      solutions[group[k]] = {std::move(tracks[k]), batch.latents.col(k),
                             std::move(batch.traces[k])};
    }
  });
  return solutions;
}

}  // namespace holdfast
