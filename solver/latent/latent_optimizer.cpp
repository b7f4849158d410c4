// SPDX-License-Identifier: MIT
#include "solver/latent/latent_optimizer.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>

#include <fmt/format.h>

#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/rollout.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/latent/latent_solve.h"
#include "solver/latent/latent_terms.h"

namespace holdfast {
namespace {

constexpr int kContactsEvery = 10;  // iterations between contact updates
constexpr int kHistory = 10;        // L-BFGS history

void Append(const ReachSolution& more, ReachSolution& solution) {
  ReachTrace& trace = solution.trace;
  const float before = trace.seconds.empty() ? 0.0f : trace.seconds.back();
  const auto add = [](const auto& from, auto& to) {
    to.insert(to.end(), from.begin(), from.end());
  };
  add(more.trace.closest_m, trace.closest_m);
  add(more.trace.last_m, trace.last_m);
  for (const float seconds : more.trace.seconds) trace.seconds.push_back(before + seconds);
  add(more.solves, solution.solves);
}

// Optimization of one motion: all terms by L-BFGS, then the goal by Levenberg-Marquardt.
class LatentMotion {
 public:
  LatentMotion(RolloutBatch<float>& batch, int index, const ReachTask& task, const LatentBody& body,
               const LatentOptions& options, ReachSolution& solution)
      : batch_(batch),
        index_(index),
        task_(task),
        body_(body),
        options_(options),
        solution_(solution),
        joint_(GoalJoint(options)),
        center_(
            wandr::DrawLatents(task.seed, task.stream, batch.LatentSize(), batch.NumSteps(), 1.0)
                .cast<double>()),
        latents_(center_) {}

  void Descend() {
    for (int done = 0; done < options_.lbfgs_iterations; done += kContactsEvery) {
      const double share = static_cast<double>(done) / options_.lbfgs_iterations;
      natural_.Clear();
      RolloutCost<float> cost(batch_, index_, MotionView(PointsOf(body_)), {},
                              [&](const MotionView& motion, MotionGradient& bar) {
                                return AllTerms(motion, share, bar);
                              });
      const int most = std::min(kContactsEvery, options_.lbfgs_iterations - done);
      Note(MinimizeLatents(cost, center_, options_.prior, LbfgsOptions(most, kHistory), latents_,
                           [&](int i) {
                             if (i > 0 || done == 0) See(cost.Motion());
                             return false;
                           }));
    }
    // A motion that fails at its first evaluation is reported as not finite.
    if (solution_.trace.closest_m.empty()) latents_.setConstant(NAN);
  }

  void Refine() {
    // The goal dominates: an error of 1 cm counts as much as an energy of 0.05.
    constexpr double kSigma_m = 0.01, kRest = 10.0;
    constexpr double kFarOff_m = 0.5;  // unreachable by walking: the body would glide
    if (goal_error_m_ <= options_.lm_goal_m || options_.lm_iterations == 0) return;
    if (goal_error_m_ > kFarOff_m) return;
    RolloutCost<float> cost(batch_, index_, MotionView(PointsOf(body_)),
                            GoalRows{arrival_, joint_, task_.goal, kSigma_m},
                            [&](const MotionView& motion, MotionGradient& bar) {
                              const double value = AllTerms(motion, 1.0, bar);
                              bar.joints *= kRest;
                              bar.poses *= kRest;
                              return kRest * value;
                            });
    Note(MinimizeLatents(cost, center_, kRest * options_.prior,
                         LevenbergMarquardtOptions(options_.lm_iterations, 0.1), latents_,
                         [&](int i) {
                           if (i > 0) See(cost.Motion());
                           return goal_error_m_ <= options_.lm_goal_m;
                         }));
  }

  Eigen::VectorXf Latents() const { return latents_.cast<float>(); }

 private:
  // Contacts, standing and the path are determined from the first motion.
  double AllTerms(const MotionView& motion, double share_done, MotionGradient& bar) {
    if (natural_.NumBlocks() == 0) AddNaturalTerms(body_, options_, motion, task_, natural_);
    MotionObjective goal;
    AddGoalTerms(options_, task_, share_done, motion.NumFrames(), goal);
    return goal.Evaluate(motion, &bar) + natural_.Evaluate(motion, &bar);
  }

  // Merges consecutive solves by the same minimizer.
  void Note(const LatentSolve& solve) {
    std::vector<LatentSolve>& all = solution_.solves;
    if (all.empty() || all.back().minimizer != solve.minimizer) {
      all.push_back(solve);
      return;
    }
    all.back().iterations += solve.iterations;
    all.back().termination = solve.termination;
  }

  void See(const MotionView& motion) {
    Record(motion, joint_, task_.goal, batch_.Seconds(), solution_.trace);
    const auto distance = [&](int t) { return (motion.At(t, joint_) - task_.goal).norm(); };
    // With a fixed deadline the goal counts only then.
    arrival_ = task_.deadline;
    for (int t = 0; options_.free_time && t < motion.NumFrames(); ++t) {
      if (t == 0 || distance(t) < distance(arrival_)) arrival_ = t;
    }
    goal_error_m_ = distance(arrival_);
  }

  RolloutBatch<float>& batch_;
  int index_;
  const ReachTask& task_;
  const LatentBody& body_;
  const LatentOptions& options_;
  ReachSolution& solution_;
  int joint_;
  Eigen::VectorXd center_, latents_;
  MotionObjective natural_;
  int arrival_ = 0;
  double goal_error_m_ = INFINITY;
};

// One entry of `all` per task; they differ in weights and iterations only.
std::vector<ReachSolution> OptimizeTogether(const wandr::Network<float>& network,
                                            const LatentBody& body,
                                            std::span<const ReachTask> tasks,
                                            std::span<const LatentOptions> all) {
  const LatentOptions& options = all[0];
  std::vector<wandr::RolloutStart<float>> starts;
  std::vector<wandr::GoalPlan> plans;
  for (const ReachTask& task : tasks) {
    starts.push_back(task.start);
    plans.push_back(options.with_intention ? wandr::GoalPlan{{task.goal, task.deadline}}
                                           : wandr::GoalPlan{});
  }
  const int steps = tasks[0].num_steps, count = static_cast<int>(tasks.size());
  RolloutBatch<float> batch(network, body.bones, options.intention, starts, plans, steps,
                            options.poll);
  std::vector<ReachSolution> solutions(tasks.size());
  std::vector<LatentMotion> motions;
  for (int i = 0; i < count; ++i) {
    motions.emplace_back(batch, i, tasks[i], body, all[i], solutions[i]);
  }
  batch.Solve([&](int i) { motions[i].Descend(); });
  batch.Solve([&](int i) { motions[i].Refine(); });
  Eigen::MatrixXf latents(Eigen::Index{network.LatentSize()} * steps, count);
  for (int i = 0; i < count; ++i) latents.col(i) = solutions[i].latents = motions[i].Latents();
  wandr::RolloutRequest request;
  request.starts = starts;
  request.plans = plans;
  request.num_steps = steps;
  request.latents = &latents;
  std::vector<wandr::RolloutTrack> tracks =
      wandr::RunRollouts(network, body.bones, request, 1, {options.intention});
  for (int i = 0; i < count; ++i) solutions[i].track = std::move(tracks[i]);
  return solutions;
}

constexpr int kHurries = 2;
constexpr int kOtherStarts = 2;
constexpr std::uint64_t kOtherStreams = 1'000'000'000'000;  // far from those of other goals

// Relaxed options for a tight deadline: steps, turns and leans that people avoid when they have
// time, and a higher weight on the goal.
LatentOptions InAHurry(LatentOptions options) {
  options.goal *= 4.0;
  options.lm_iterations += 10;
  options.path *= 0.5;
  options.cadence *= 0.3;
  options.fastest_turn_rad_s *= 1.4;
  options.farthest_lean_reaching_m *= 1.5;
  return options;
}

// Faults of a motion. Running to a goal counts as a miss, and being airborne for a tenth of the
// time is as bad as a miss.
struct MotionFault {
  bool missed = false;
  double airborne_share = 0.0;
  double Sum() const { return (missed ? 1.0 : 0.0) + 10.0 * airborne_share; }
};

MotionFault FaultOf(const ReachSolution& solution, const ReachTask& task) {
  constexpr double kRuns_m_s = 3.0;
  const wandr::ReachOutcome outcome = wandr::MeasureReach(solution.track.joints, task.goal);
  return {!outcome.Reached() || outcome.peak_pelvis_m_s > kRuns_m_s, outcome.airborne_share};
}

// Retries motions that are airborne or miss the goal: twice with increasingly relaxed options, then
// from other latents.
std::vector<ReachSolution> OptimizeBatch(const wandr::Network<float>& network,
                                         const LatentBody& body, std::span<const ReachTask> tasks,
                                         const LatentOptions& options) {
  std::vector<ReachSolution> solutions =
      OptimizeTogether(network, body, tasks, std::vector(tasks.size(), options));
  if (!options.hurries) return solutions;
  LatentOptions hurry = options;
  for (int tried = 0; tried < kHurries + kOtherStarts; ++tried) {
    if (tried < kHurries) hurry = InAHurry(hurry);
    std::vector<std::size_t> faulty;
    std::vector<ReachTask> retried;
    std::vector<LatentOptions> relaxed;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      const MotionFault fault = FaultOf(solutions[i], tasks[i]);
      if (fault.Sum() == 0.0) continue;
      faulty.push_back(i);
      retried.push_back(tasks[i]);
      if (tried >= kHurries) retried.back().stream += kOtherStreams * (1 + tried - kHurries);
      relaxed.push_back(hurry);
      if (fault.airborne_share == 0.0) continue;
      // A higher weight on the goal would encourage jumping.
      relaxed.back().goal = options.goal;
      relaxed.back().lm_iterations = options.lm_iterations;
    }
    if (faulty.empty()) break;
    std::vector<ReachSolution> again = OptimizeTogether(network, body, retried, relaxed);
    for (std::size_t k = 0; k < faulty.size(); ++k) {
      ReachSolution& solution = solutions[faulty[k]];
      const ReachTask& task = tasks[faulty[k]];
      if (FaultOf(again[k], task).Sum() >= FaultOf(solution, task).Sum()) continue;
      Append(again[k], solution);
      again[k].trace = std::move(solution.trace);
      again[k].solves = std::move(solution.solves);
      solution = std::move(again[k]);
    }
  }
  return solutions;
}

// Wraps `poll`: an exception on any thread ends all threads at their next call.
std::function<void()> EndsAll(const std::function<void()>& poll) {
  struct Ended {
    std::mutex mutex;
    std::exception_ptr reason;
  };
  return [poll, ended = std::make_shared<Ended>()] {
    {
      const std::lock_guard lock(ended->mutex);
      if (ended->reason) std::rethrow_exception(ended->reason);
    }
    try {
      poll();
    } catch (...) {
      const std::lock_guard lock(ended->mutex);
      if (!ended->reason) ended->reason = std::current_exception();
      throw;
    }
  };
}

}  // namespace

std::vector<ReachSolution> OptimizeLatents(const wandr::Network<float>& network,
                                           const LatentBody& body, std::span<const ReachTask> tasks,
                                           const LatentOptions& options, int threads,
                                           const std::function<void(int, int)>& progress) {
  if (tasks.empty()) throw Error("reach", "has no tasks", "Give at least one goal");
  for (const ReachTask& task : tasks) {
    if (task.num_steps != tasks[0].num_steps) {
      throw Error("reach", "has tasks of different lengths", "Optimize them separately");
    }
    if (task.deadline < 1 || task.deadline > task.num_steps) {
      throw Error("reach",
                  fmt::format("deadline {} in a motion of {} steps", task.deadline, task.num_steps),
                  "Give the motion more time");
    }
    if (!task.goal.allFinite() || !wandr::StateOf(task.start.pose).allFinite() ||
        !task.start.previous_delta.allFinite()) {
      throw Error("reach", "goal or start pose is not finite", "Check the clip it comes from");
    }
  }
  std::vector<ReachSolution> solutions(tasks.size());
  LatentOptions polled = options;
  if (options.poll) polled.poll = EndsAll(options.poll);
  const int total = static_cast<int>(tasks.size());
  const int size =
      std::clamp((total + threads - 1) / std::max(threads, 1), 1, std::max(options.batch, 1));
  std::mutex progress_mutex;
  int done = 0;
  ParallelFor((total + size - 1) / size, threads, [&](int b) {
    const int first = b * size, count = std::min(size, total - first);
    std::vector<ReachSolution> part = OptimizeBatch(
        network, body,
        tasks.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count)), polled);
    std::ranges::move(part, solutions.begin() + first);
    if (!progress) return;
    const std::lock_guard lock(progress_mutex);
    progress(done += count, total);
  });
  return solutions;
}

}  // namespace holdfast
