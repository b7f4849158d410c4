// SPDX-License-Identifier: MIT
#include "solver/latent/latent_problem.h"

#include <algorithm>
#include <cmath>

#include "solver/latent/latent_terms.h"
#include "solver/terms/motion/latent_prior.h"

namespace holdfast {
namespace {

constexpr int kContactsEvery = 10;  // iterations after which contacts are found anew

}  // namespace

LatentProblem::LatentProblem(const wandr::Network<float>& network, const LatentBody& body,
                             const LatentOptions& options, int num_steps, int capacity)
    : body_(body),
      bones_(body.bones.Cast<double>()),
      options_(options),
      steps_(num_steps),
      latent_size_(network.LatentSize()),
      rollout_(network, body.bones, capacity, num_steps, {options.intention}, true) {}

void LatentProblem::Forward(std::span<LatentSample* const> samples, bool trial) {
  std::vector<wandr::RolloutStart<float>> starts;
  std::vector<wandr::GoalPlan> plans;
  for (const LatentSample* one : samples) {
    starts.push_back(one->task->start);
    plans.push_back(options_.with_intention
                        ? wandr::GoalPlan{{one->task->goal, one->task->deadline}}
                        : wandr::GoalPlan{});
  }
  const auto count = static_cast<Eigen::Index>(samples.size());
  rollout_.Begin(starts, plans);
  Eigen::MatrixXf step(latent_size_, count);
  for (int t = 0; t < steps_; ++t) {
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::VectorXf& z = samples[static_cast<std::size_t>(i)]->latents;
      step.col(i) = z.segment(static_cast<Eigen::Index>(t) * latent_size_, latent_size_);
    }
    rollout_.Step(step);
  }
  const int joint = GoalJoint(options_);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    LatentSample& one = *samples[i];
    one.motion.Resize(steps_ + 1);
    one.closest_m = INFINITY;
    for (int t = 0; t <= steps_; ++t) {
      one.motion.Set(t, rollout_.Poses(t)[i], bones_);
      const double distance = (one.motion.At(t, joint) - one.task->goal).norm();
      one.last_m = distance;
      if (!(distance < one.closest_m)) continue;
      one.closest_m = distance;
      one.arrival = t;
    }
    // With a time given the goal counts then, and nowhere else.
    one.goal_error_m = one.closest_m;
    if (!options_.free_time) {
      one.arrival = std::min(one.task->deadline, steps_);
      one.goal_error_m = (one.motion.At(one.arrival, joint) - one.task->goal).norm();
    }
    if (trial) continue;
    if (one.contacts_age == 0 || ++one.contacts_age > kContactsEvery) {
      one.natural.Clear();
      AddNaturalTerms(body_, options_, one.motion, *one.task, one.natural);
      one.contacts_age = 1;
    }
  }
}

void LatentProblem::Gradient(std::span<LatentSample* const> samples, double share_done) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  Prepare(count);
  MotionGradient motion_bar;
  for (Eigen::Index i = 0; i < count; ++i) {
    LatentSample& one = *samples[static_cast<std::size_t>(i)];
    MotionObjective goal;
    AddGoalTerms(options_, *one.task, share_done, steps_ + 1, goal);
    motion_bar.SetZero(steps_ + 1);
    one.value = goal.Evaluate(one.motion, &motion_bar);
    one.value += one.natural.Evaluate(one.motion, &motion_bar);
    Put(motion_bar, i);
  }
  rollout_.Backward(seed_, 1, gradient_);
  for (Eigen::Index i = 0; i < count; ++i) {
    LatentSample& one = *samples[static_cast<std::size_t>(i)];
    one.gradient = gradient_.latents.col(i);
    one.value += LatentPrior::AddGradient(one.latents, one.centre, options_.prior, one.gradient);
  }
}

void LatentProblem::Rows(std::span<LatentSample* const> samples, double sigma_m,
                         double penalty_scale, std::vector<Eigen::MatrixXf>& J,
                         std::vector<Eigen::Vector4d>& r) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  Prepare(4 * count);
  J.resize(samples.size());
  r.resize(samples.size());
  MotionGradient motion_bar;
  const int joint = GoalJoint(options_);
  for (Eigen::Index i = 0; i < count; ++i) {
    LatentSample& one = *samples[static_cast<std::size_t>(i)];
    Eigen::Vector4d& residual = r[static_cast<std::size_t>(i)];
    residual.head<3>() = (one.motion.At(one.arrival, joint) - one.task->goal) / sigma_m;
    for (int k = 0; k < 3; ++k) {
      motion_bar.SetZero(steps_ + 1);
      motion_bar.joints(3 * joint + k, one.arrival) = 1.0 / sigma_m;
      Put(motion_bar, 4 * i + k);
    }
    motion_bar.SetZero(steps_ + 1);
    const double rest = penalty_scale * one.natural.Evaluate(one.motion, &motion_bar);
    residual[3] = std::sqrt(2.0 * rest + 1e-12);
    motion_bar.joints *= penalty_scale / residual[3];
    motion_bar.poses *= penalty_scale / residual[3];
    Put(motion_bar, 4 * i + 3);
  }
  rollout_.Backward(seed_, 4, gradient_);
  for (Eigen::Index i = 0; i < count; ++i) {
    J[static_cast<std::size_t>(i)] = gradient_.latents.middleCols(4 * i, 4);
  }
}

wandr::RolloutTrack LatentProblem::TrackOf(std::size_t i) const {
  wandr::RolloutTrack track;
  track.states.resize(wandr::kStateSize, steps_ + 1);
  track.joints.resize(wandr::kJointNumbers, steps_ + 1);
  wandr::BodyKinematics<float> kinematics;
  for (int t = 0; t <= steps_; ++t) {
    const wandr::Pose<float>& pose = rollout_.Poses(t)[i];
    track.states.col(t) = wandr::StateOf(pose);
    wandr::ForwardKinematics(body_.bones, pose, kinematics);
    Eigen::Map<wandr::BodyJoints<float>>(track.joints.col(t).data()) = kinematics.joints;
  }
  return track;
}

double LatentProblem::Natural(const LatentSample& one) const {
  return one.natural.Evaluate(one.motion);
}

void LatentProblem::Prepare(Eigen::Index columns) {
  seed_.joints.resize(static_cast<std::size_t>(steps_) + 1);
  seed_.poses.resize(static_cast<std::size_t>(steps_) + 1);
  for (auto& joints : seed_.joints) joints.resize(wandr::kJointNumbers, columns);
  for (auto& poses : seed_.poses) poses.resize(wandr::kTangentSize, columns);
}

void LatentProblem::Put(const MotionGradient& bar, Eigen::Index column) {
  for (int t = 0; t <= steps_; ++t) {
    seed_.joints[static_cast<std::size_t>(t)].col(column) = bar.joints.col(t).cast<float>();
    seed_.poses[static_cast<std::size_t>(t)].col(column) = bar.poses.col(t).cast<float>();
  }
}

}  // namespace holdfast
