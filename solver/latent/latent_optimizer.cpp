// SPDX-License-Identifier: MIT
#include "solver/latent/latent_optimizer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>

#include <fmt/format.h>

#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/run_rollouts.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/latent/dual_gauss_newton.h"
#include "solver/latent/latent_problem.h"
#include "solver/latent/latent_terms.h"
#include "solver/latent/step_rule.h"

namespace holdfast {
namespace {

using Clock = std::chrono::steady_clock;

std::vector<LatentSample*> Pointers(std::vector<LatentSample>& all) {
  std::vector<LatentSample*> out;
  for (LatentSample& one : all) {
    if (!one.done) out.push_back(&one);
  }
  return out;
}

void Record(LatentSample& one, ReachTrace& trace, double seconds) {
  trace.closest_m.push_back(static_cast<float>(one.closest_m));
  trace.last_m.push_back(static_cast<float>(one.last_m));
  trace.seconds.push_back(static_cast<float>(seconds));
}

void Append(const ReachTrace& more, ReachTrace& trace) {
  const float before = trace.seconds.empty() ? 0.0f : trace.seconds.back();
  trace.closest_m.insert(trace.closest_m.end(), more.closest_m.begin(), more.closest_m.end());
  trace.last_m.insert(trace.last_m.end(), more.last_m.begin(), more.last_m.end());
  for (const float seconds : more.seconds) trace.seconds.push_back(before + seconds);
}

class LatentBatchOptimizer {
 public:
  LatentBatchOptimizer(const wandr::Network<float>& network, const LatentBody& body,
                       std::span<const ReachTask> tasks, const LatentOptions& options)
      : options_(options),
        latent_size_(network.LatentSize()),
        steps_(tasks[0].num_steps),
        problem_(network, body, options, steps_, static_cast<int>(tasks.size())),
        solutions_(tasks.size()),
        started_(Clock::now()) {
    const std::vector<BodyPoint> points = PointsOf(body);
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      LatentSample one;
      one.task = &tasks[i];
      one.index = static_cast<int>(i);
      one.motion = MotionView(points);
      one.centre =
          wandr::DrawLatents(tasks[i].seed, tasks[i].stream, network.LatentSize(), steps_, 1.0);
      one.latents = one.centre;
      adams_.emplace_back(AdamRates{.first = options.adam_step,
                                    .last_ratio = 0.05,
                                    .iterations = options.adam_iterations + 1,
                                    .square_decay = 0.99,
                                    .tiny = 1e-12});
      samples_.push_back(std::move(one));
    }
  }

  std::vector<ReachSolution> Run() {
    Descend();
    GaussNewton();
    std::vector<LatentSample*> all;
    for (LatentSample& one : samples_) all.push_back(&one);
    problem_.Forward(all, true);
    for (std::size_t i = 0; i < all.size(); ++i) {
      solutions_[i].track = problem_.TrackOf(i);
      solutions_[i].latents = all[i]->latents;
    }
    return std::move(solutions_);
  }

 private:
  double Seconds() const {
    return std::chrono::duration<double>(Clock::now() - started_).count() /
           static_cast<double>(samples_.size());
  }

  void Descend() {
    for (int iteration = 0; iteration <= options_.adam_iterations; ++iteration) {
      const std::vector<LatentSample*> moving = Pointers(samples_);
      if (moving.empty()) break;
      if (options_.poll) options_.poll();
      problem_.Forward(moving);
      const double seconds = Seconds();
      for (LatentSample* one : moving) {
        Record(*one, solutions_[static_cast<std::size_t>(one->index)].trace, seconds);
        one->done =
            iteration == options_.adam_iterations || (iteration >= options_.least_iterations &&
                                                      one->goal_error_m <= options_.close_enough_m);
      }
      const double share = static_cast<double>(iteration) / std::max(1, options_.adam_iterations);
      problem_.Gradient(moving, share);
      for (LatentSample* one : moving) {
        if (one->done) continue;
        adams_[static_cast<std::size_t>(one->index)].Step(iteration, one->gradient, one->latents);
      }
    }
    for (LatentSample& one : samples_) one.done = false;
  }

  void GaussNewton() {
    // A centimetre off the goal counts as much as what moves five on the way there.
    constexpr double kSigma = 0.01, kKappa = 1e-2, kLess = 0.05;
    constexpr double penalty_scale = 1.0 / (0.05 * 0.05);
    const auto size = static_cast<double>(latent_size_) * steps_;
    std::vector<Eigen::MatrixXf> J;
    std::vector<Eigen::Vector4d> r;
    std::vector<double> radii(samples_.size(), 0.15);
    std::vector<int> refusals(samples_.size(), 0);
    for (int iteration = 0; iteration < options_.newton_iterations; ++iteration) {
      for (LatentSample& one : samples_) {
        one.done = one.done || one.goal_error_m <= options_.newton_goal_m ||
                   refusals[static_cast<std::size_t>(one.index)] > 4;
      }
      const std::vector<LatentSample*> moving = Pointers(samples_);
      if (moving.empty()) break;
      if (options_.poll) options_.poll();
      problem_.Forward(moving, true);
      problem_.Rows(moving, kSigma, penalty_scale, J, r);
      std::vector<Eigen::VectorXf> before;
      std::vector<double> value;
      for (std::size_t i = 0; i < moving.size(); ++i) {
        LatentSample& one = *moving[i];
        // The rest is no residual that can vanish: a little less of it is asked for.
        const Eigen::Vector4d wanted(r[i][0], r[i][1], r[i][2], kLess * r[i][3]);
        Eigen::VectorXf step = DualStep(J[i], wanted, kKappa, latent_size_);
        const double rms = std::sqrt(static_cast<double>(step.squaredNorm()) / size);
        const double radius = radii[static_cast<std::size_t>(one.index)];
        if (rms > radius) step *= static_cast<float>(radius / rms);
        before.push_back(one.latents);
        value.push_back(r[i].squaredNorm());
        one.latents += step;
      }
      problem_.Forward(moving, true);
      const double seconds = Seconds();
      for (std::size_t i = 0; i < moving.size(); ++i) {
        LatentSample& one = *moving[i];
        const auto at = static_cast<std::size_t>(one.index);
        const double trial = one.goal_error_m * one.goal_error_m / (kSigma * kSigma) +
                             2.0 * penalty_scale * problem_.Natural(one);
        if (trial < value[i]) {
          radii[at] *= 1.5;
          refusals[at] = 0;
        } else {
          one.latents = before[i];
          radii[at] *= 0.4;
          ++refusals[at];
          one.goal_error_m = r[i].head<3>().norm() * kSigma;
        }
        Record(one, solutions_[static_cast<std::size_t>(one.index)].trace, seconds);
      }
    }
  }

  const LatentOptions& options_;
  Eigen::Index latent_size_;
  int steps_;
  LatentProblem problem_;
  std::vector<Adam> adams_;
  std::vector<LatentSample> samples_;
  std::vector<ReachSolution> solutions_;
  Clock::time_point started_;
};

constexpr int kHurries = 2;
constexpr int kOtherStarts = 2;
constexpr std::uint64_t kOtherStreams = 1'000'000'000'000;  // far from those of other goals

// For who is in a hurry: steps, turns and leans that people who have time do not make, and a goal
// that is not given up for them.
LatentOptions InAHurry(LatentOptions options) {
  options.goal *= 4.0;
  options.newton_iterations += 10;
  options.path *= 0.5;
  options.cadence *= 0.3;
  options.fastest_turn_rad_s *= 1.4;
  options.farthest_lean_reaching_m *= 1.5;
  return options;
}

// Of a motion. Who has to run for a goal has not reached it, and who is off the ground for a tenth
// of the time is no better than who misses it.
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

// Who is off the ground, or does not get there, tries again in a hurry, then in a greater one, and
// then from other latents.
std::vector<ReachSolution> OptimiseBatch(const wandr::Network<float>& network,
                                         const LatentBody& body, std::span<const ReachTask> tasks,
                                         const LatentOptions& options) {
  std::vector<ReachSolution> solutions = LatentBatchOptimizer(network, body, tasks, options).Run();
  if (!options.hurries) return solutions;
  LatentOptions hurry = options;
  for (int tried = 0; tried < kHurries + kOtherStarts; ++tried) {
    if (tried < kHurries) hurry = InAHurry(hurry);
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      const MotionFault fault = FaultOf(solutions[i], tasks[i]);
      if (fault.Sum() == 0.0) continue;
      LatentOptions its = hurry;
      // A goal that counts more would be jumped for all the more.
      if (fault.airborne_share > 0.0) {
        its.goal = options.goal;
        its.newton_iterations = options.newton_iterations;
      }
      ReachTask task = tasks[i];
      if (tried >= kHurries) task.stream += kOtherStreams * (1 + tried - kHurries);
      ReachSolution again =
          std::move(LatentBatchOptimizer(network, body, {&task, 1}, its).Run()[0]);
      if (FaultOf(again, tasks[i]).Sum() >= fault.Sum()) continue;
      Append(again.trace, solutions[i].trace);
      again.trace = std::move(solutions[i].trace);
      solutions[i] = std::move(again);
    }
  }
  return solutions;
}

// What `poll` throws once, on any thread, ends all of them at their next call.
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

std::vector<ReachSolution> OptimiseLatents(const wandr::Network<float>& network,
                                           const LatentBody& body, std::span<const ReachTask> tasks,
                                           const LatentOptions& options, int threads,
                                           const std::function<void(int, int)>& progress) {
  if (tasks.empty()) throw Error("reach", "has no tasks", "Give at least one goal");
  for (const ReachTask& task : tasks) {
    if (task.num_steps != tasks[0].num_steps) {
      throw Error("reach", "tasks of different lengths", "Optimise them apart");
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
    std::vector<ReachSolution> part = OptimiseBatch(
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
