// SPDX-License-Identifier: MIT
#include "solver/latent/rollout_cost.h"

#include <cassert>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

namespace holdfast {
template <typename Real>
RolloutCost<Real>::RolloutCost(RolloutBatch<Real>& batch, int motion, MotionView view,
                               std::optional<GoalRows> goal, MotionEnergy rest)
    : batch_(batch), motion_(motion), goal_(goal), rest_(std::move(rest)), view_(std::move(view)) {
  view_.Resize(batch.NumSteps() + 1);
  set_num_residuals((goal_ ? 3 : 0) + (rest_ ? 1 : 0));
  mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(batch.NumSteps()),
                                          batch.LatentSize());
}

template <typename Real>
bool RolloutCost<Real>::Evaluate(double const* const* parameters, double* residuals,
                                 double** jacobians) const {
  const int steps = batch_.NumSteps(), size = batch_.LatentSize();
  Eigen::VectorXd latents(Eigen::Index{size} * steps);
  for (int t = 0; t < steps; ++t) {
    latents.segment(Eigen::Index{size} * t, size) =
        Eigen::Map<const Eigen::VectorXd>(parameters[t], size);
  }
  if (!Look(latents)) return false;
  Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = residuals_;
  for (int t = 0; jacobians != nullptr && t < steps; ++t) {
    if (jacobians[t] == nullptr) continue;
    Eigen::Map<Eigen::MatrixXd>(jacobians[t], size, num_residuals()) =
        jacobian_.middleRows(Eigen::Index{size} * t, size).template cast<double>();
  }
  return true;
}

template <typename Real>
bool RolloutCost<Real>::Look(const Eigen::VectorXd& latents) const {
  if (latents.size() == latents_.size() && latents == latents_) return finite_;
  latents_ = latents;
  residuals_.setZero(num_residuals());
  finite_ = batch_.Evaluate(
                motion_, latents.cast<Real>(), num_residuals(),
                [this](const auto& pose, std::span<MotionGradient> rows) { SeedFrom(pose, rows); },
                jacobian_) &&
            residuals_.allFinite() && jacobian_.allFinite();
  return finite_;
}

template <typename Real>
void RolloutCost<Real>::SeedFrom(const typename RolloutBatch<Real>::PoseAt& pose,
                                 std::span<MotionGradient> rows) const {
  for (int t = 0; t < view_.NumFrames(); ++t) view_.Set(t, pose(t), batch_.Bones());
  if (goal_) {
    residuals_.head<3>() = (view_.At(goal_->frame, goal_->joint) - goal_->place) / goal_->sigma_m;
    for (int k = 0; k < 3; ++k) {
      rows[k].joints(3 * goal_->joint + k, goal_->frame) = 1.0 / goal_->sigma_m;
    }
  }
  if (!rest_) return;
  MotionGradient& bar = rows.back();
  const double root = std::sqrt(2.0 * rest_(view_, bar) + 1e-12);
  residuals_[num_residuals() - 1] = root;
  bar.joints /= root;
  bar.poses /= root;
}

template class RolloutCost<float>;
template class RolloutCost<double>;

template <typename Real>
RolloutBatch<Real>::RolloutBatch(const wandr::Network<Real>& network,
                                 const wandr::BoneOffsets<Real>& bones,
                                 const wandr::IntentionOptions& intention,
                                 std::vector<wandr::RolloutStart<Real>> starts,
                                 std::vector<wandr::GoalPlan> plans, int num_steps,
                                 std::function<void()> poll)
    : bones_(bones.template Cast<double>()),
      starts_(std::move(starts)),
      plans_(std::move(plans)),
      latent_size_(network.LatentSize()),
      num_steps_(num_steps),
      poll_(std::move(poll)),
      rollout_(network, bones, NumMotions(), num_steps, {intention}, true),
      requests_(starts_.size()) {
  seed_.joints.resize(static_cast<std::size_t>(num_steps) + 1);
  seed_.poses.resize(static_cast<std::size_t>(num_steps) + 1);
}

template <typename Real>
float RolloutBatch<Real>::Seconds() const {
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin_;
  return static_cast<float>(passed.count() / NumMotions());
}

template <typename Real>
void RolloutBatch<Real>::Solve(const std::function<void(int)>& solve) {
  active_ = NumMotions();
  const auto work = [&](int motion) {
    const std::lock_guard lock(working_);
    try {
      if (!failure_) solve(motion);
    } catch (...) {
      if (!failure_) failure_ = std::current_exception();
    }
    --active_;
    RunIfAllWait();
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < NumMotions(); ++i) others.emplace_back(work, i);
    work(0);
  }
  if (failure_) std::rethrow_exception(failure_);
}

template <typename Real>
bool RolloutBatch<Real>::Evaluate(int motion, const Vector& latents, int rows, const SeedRows& seed,
                                  Matrix& out) {
  assert(waiting_ == 0 || rows == rows_);
  Request& request = requests_[motion];
  request = {&latents, &seed, &out};
  rows_ = rows;
  ++waiting_;
  RunIfAllWait();
  std::unique_lock lock(working_, std::adopt_lock);
  answered_.wait(lock, [&] { return request.latents == nullptr; });
  lock.release();
  return !failure_;
}

template <typename Real>
void RolloutBatch<Real>::RunIfAllWait() {
  if (waiting_ == 0 || waiting_ < active_) return;
  try {
    if (!failure_ && poll_) poll_();
    if (!failure_) Run();
  } catch (...) {
    failure_ = std::current_exception();
  }
  for (Request& request : requests_) request = {};
  waiting_ = 0;
  answered_.notify_all();
}

template <typename Real>
void RolloutBatch<Real>::Run() {
  std::vector<int> asked;
  std::vector<wandr::RolloutStart<Real>> starts;
  std::vector<wandr::GoalPlan> plans;
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (requests_[i].latents == nullptr) continue;
    asked.push_back(static_cast<int>(i));
    starts.push_back(starts_[i]);
    plans.push_back(plans_[i]);
  }
  const auto of = [&](std::size_t k) -> Request& { return requests_[asked[k]]; };
  rollout_.Begin(starts, plans);
  Matrix step(latent_size_, asked.size());
  for (int t = 0; t < num_steps_; ++t) {
    for (std::size_t k = 0; k < asked.size(); ++k) {
      step.col(k) = of(k).latents->segment(Eigen::Index{latent_size_} * t, latent_size_);
    }
    rollout_.Step(step);
  }
  const auto columns = static_cast<Eigen::Index>(asked.size()) * rows_;
  for (Matrix& joints : seed_.joints) joints.resize(wandr::kJointNumbers, columns);
  for (Matrix& poses : seed_.poses) poses.resize(wandr::kTangentSize, columns);
  bars_.resize(static_cast<std::size_t>(rows_));
  for (std::size_t k = 0; k < asked.size(); ++k) {
    for (MotionGradient& bar : bars_) bar.SetZero(num_steps_ + 1);
    (*of(k).seed)([&](int t) -> const wandr::Pose<Real>& { return rollout_.Poses(t)[k]; }, bars_);
    for (int r = 0; r < rows_; ++r) {
      const MotionGradient& bar = bars_[r];
      const Eigen::Index column = static_cast<Eigen::Index>(k) * rows_ + r;
      for (int t = 0; t <= num_steps_; ++t) {
        const auto at = static_cast<std::size_t>(t);
        seed_.joints[at].col(column) = bar.joints.col(t).template cast<Real>();
        seed_.poses[at].col(column) = bar.poses.col(t).template cast<Real>();
      }
    }
  }
  rollout_.Backward(seed_, rows_, gradient_);
  for (std::size_t k = 0; k < asked.size(); ++k) {
    *of(k).out = gradient_.latents.middleCols(static_cast<Eigen::Index>(k) * rows_, rows_);
  }
}

template class RolloutBatch<float>;
template class RolloutBatch<double>;

}  // namespace holdfast
