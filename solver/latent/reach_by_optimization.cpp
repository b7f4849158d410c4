// SPDX-License-Identifier: MIT
#include "solver/latent/reach_by_optimization.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <fmt/format.h>

#include "generator/wandr/motion_states.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/walk_pace.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/latent/latent_terms.h"

namespace holdfast {
namespace {

constexpr int kStay = 16;  // frames: enough for WarpReach after it
constexpr int kRetries =
    2;                      // of a missed goal, from other latents and with half as much time again
constexpr int kWrist = 21;  // right wrist
constexpr std::uint64_t kStreams = 1'000'000;  // separates the latents of other goals and retries

// One motion, extended goal by goal.
class MultiGoalMotion {
 public:
  MultiGoalMotion(const wandr::Network<float>& network, const LatentBody& body,
                  const wandr::RolloutStart<float>& start, std::span<const Eigen::Vector3d> goals,
                  int index, const ReachByOptimizationOptions& options)
      : network_(network),
        body_(body),
        options_(options),
        goals_(goals),
        stream_(static_cast<std::uint64_t>(index)),
        here_(start) {
    sample_.goals.resize(goals.size());
    wandr::BodyKinematics<float> kinematics;
    wandr::ForwardKinematics(body.bones, start.pose, kinematics);
    sample_.track.states = wandr::StateOf(start.pose);
    sample_.track.joints = kinematics.joints.reshaped(wandr::kJointNumbers, 1);
    sample_.goal_of_frame.push_back(0);
  }

  void Reach(std::size_t g) {
    const auto first = static_cast<int>(sample_.track.states.cols()) - 1;
    ReachSolution best;
    double closest = INFINITY;
    int due = 0;
    for (int attempt = 0; attempt <= kRetries; ++attempt) {
      int frames = 0;
      const ReachSolution solution = Solve(g, attempt, frames);
      const wandr::ReachOutcome outcome = wandr::MeasureReach(solution.track.joints, goals_[g]);
      if (!outcome.diverged && (attempt == 0 || outcome.closest_m < closest)) {
        closest = outcome.closest_m;
        best = solution;
        due = frames;
      }
      sample_.diverged = !std::isfinite(closest);
      if (closest <= wandr::kReachedWithin || options_.frames || options_.as_published) break;
    }
    if (sample_.diverged) return;
    Append(best, g, first, due);
  }

  wandr::ReachSample& Sample() { return sample_; }
  std::vector<LatentSolve>& Solves() { return solves_; }

  /// Frames at which the wrist must be exactly at each reached goal.
  std::vector<RefitGoal> RefitGoals() const {
    std::vector<RefitGoal> out;
    for (std::size_t g = 0; g < goals_.size(); ++g) {
      if (sample_.goals[g].Reached())
        out.push_back({goals_[g], at_goal_[g], g + 1 == goals_.size()});
    }
    return out;
  }

  /// Recomputes outcomes after appending a part or refitting.
  void Measure() { wandr::MeasureGoals(goals_, kWrist, sample_); }

 private:
  int Stay(std::size_t g) const {
    return g < options_.stay_frames.size() ? options_.stay_frames[g] : kStay;
  }

  ReachSolution Solve(std::size_t g, int attempt, int& frames) const {
    const Eigen::Vector3d pelvis =
        (here_.pose.translation + body_.bones.offset.col(0)).cast<double>();
    ReachTask task;
    task.start = here_;
    task.goal = goals_[g];
    task.velocity = wandr::StartVelocity(network_, here_);
    const int due =
        options_.as_published
            ? wandr::DeadlineRule{.max_frames = 900.0}.Frames((goals_[g] - pelvis).head<2>().norm())
            : wandr::PaceOf(here_, pelvis, task.velocity, task.goal).Deadline();
    frames = options_.frames.value_or(due);
    frames += frames * attempt / 2;
    task.deadline = frames;
    task.num_steps = frames + (options_.as_published ? 0 : Stay(g));
    task.seed = options_.seed;
    task.stream = stream_ + kStreams * (g * 16 + static_cast<std::size_t>(attempt));
    if (options_.as_published) {
      return OptimizeAsPublished(network_, body_.bones, {&task, 1}, options_.vae, 1)[0];
    }
    LatentOptions latent = options_.latent;
    latent.hold_frames = Stay(g);
    return OptimizeLatents(network_, body_, {&task, 1}, latent, 1)[0];
  }

  void Append(const ReachSolution& solution, std::size_t g, int first, int due) {
    const Eigen::Index before = first + 1, added = solution.track.states.cols() - 1;
    sample_.track.states.conservativeResize(Eigen::NoChange, before + added);
    sample_.track.joints.conservativeResize(Eigen::NoChange, before + added);
    sample_.track.states.rightCols(added) = solution.track.states.rightCols(added);
    sample_.track.joints.rightCols(added) = solution.track.joints.rightCols(added);
    sample_.goal_of_frame.resize(static_cast<std::size_t>(before + added), static_cast<int>(g));
    wandr::GoalOutcome& outcome = sample_.goals[g];
    outcome.taken_on = first;
    outcome.due = first + due;
    outcome.left = static_cast<int>(before + added) - 1;
    solves_.insert(solves_.end(), solution.solves.begin(), solution.solves.end());
    at_goal_.push_back(std::min(outcome.due, outcome.left));
    Measure();
    if (options_.as_published || options_.latent.free_time) at_goal_.back() = outcome.closest_frame;
    // The next part continues from this pose and the step that led to it.
    const wandr::StateMatrix<float> last = sample_.track.states.rightCols<2>();
    const wandr::Pose<float> pose = wandr::PoseOf<float>(last.col(1));
    const wandr::StateVector<float> delta =
        wandr::DeltaBetween<float>(wandr::PoseOf<float>(last.col(0)), pose);
    here_ = {pose, wandr::NormalizedDelta<float>(network_.Norms(), delta)};
  }

  const wandr::Network<float>& network_;
  const LatentBody& body_;
  const ReachByOptimizationOptions& options_;
  std::span<const Eigen::Vector3d> goals_;
  std::uint64_t stream_;
  wandr::RolloutStart<float> here_;
  wandr::ReachSample sample_;
  std::vector<LatentSolve> solves_;
  std::vector<int> at_goal_;
};

void Refit(const BodyMeasures& measures, const LatentBody& body, MultiGoalMotion& motion,
           RefitReport& report) {
  wandr::RolloutTrack& track = motion.Sample().track;
  track.states = RefitReach(measures, track.states.cast<double>(), motion.RefitGoals(), {}, &report)
                     .cast<float>();
  track.joints = wandr::JointsOfStates(track.states, body.bones);
  motion.Measure();
}

}  // namespace

std::vector<OptimizedReach> ReachByOptimization(const wandr::Network<float>& network,
                                                const BodyMeasures& measures,
                                                const wandr::RolloutStart<float>& start,
                                                std::span<const Eigen::Vector3d> goals, int count,
                                                int threads,
                                                const ReachByOptimizationOptions& options,
                                                const std::function<void(int, int)>& progress) {
  if (goals.empty() || count < 1) {
    throw Error("reach", fmt::format("{} goals, {} samples", goals.size(), count),
                "Give at least one goal, and request at least one sample");
  }
  const LatentBody body = LatentBodyOf(measures.rest_joints, measures.sole_y);
  std::vector<OptimizedReach> reaches(static_cast<std::size_t>(count));
  std::mutex progress_mutex;
  const int parts = count * static_cast<int>(goals.size());
  int done = 0;
  ParallelFor(count, threads, [&](int i) {
    MultiGoalMotion motion(network, body, start, goals, i, options);
    for (std::size_t g = 0; g < goals.size() && !motion.Sample().diverged; ++g) {
      motion.Reach(g);
      const std::lock_guard lock(progress_mutex);
      if (progress) progress(++done, parts);
    }
    OptimizedReach& reach = reaches[i];
    if (options.refit && !motion.Sample().diverged) Refit(measures, body, motion, reach.refit);
    reach.sample = std::move(motion.Sample());
    reach.solves = std::move(motion.Solves());
  });
  return reaches;
}

}  // namespace holdfast
