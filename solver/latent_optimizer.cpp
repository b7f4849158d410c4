// SPDX-License-Identifier: MIT
#include "solver/latent_optimizer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "generator/matching/capture_quality.h"
#include "generator/matching/sole_contact.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/rollout.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/motion_objective.h"
#include "solver/terms/airborne.h"
#include "solver/terms/approach_direction.h"
#include "solver/terms/first_arrival.h"
#include "solver/terms/floor_contact.h"
#include "solver/terms/foot_skate.h"
#include "solver/terms/joint_acceleration.h"
#include "solver/terms/joint_goal.h"
#include "solver/terms/latent_prior.h"
#include "solver/terms/look_at.h"
#include "solver/terms/obstacle.h"
#include "solver/terms/pelvis_path.h"
#include "solver/terms/pelvis_speed.h"
#include "solver/terms/rotation_range.h"
#include "solver/terms/stand_near.h"
#include "solver/terms/standing_balance.h"

namespace holdfast {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kFrame = 1.0 / wandr::kFramesPerSecond;
constexpr int kPace = 10;           // frames over which the pelvis' speed is taken
constexpr int kBurst = 2;           // the same, of single steps
constexpr int kCreep = 6;           // frames over which a planted foot is not to creep
constexpr int kArriving = 5;        // frames before the deadline
constexpr int kContactsEvery = 10;  // iterations after which contacts are found anew
constexpr int kHeadJoint = 15;
constexpr double kStandsStill = 0.25;  // m/s

int GoalJoint(const LatentOptions& options) {
  return options.goal_joint > 0 ? options.goal_joint : WristJoint(options.intention.wrist);
}

/// The objective of one task, but for the goal: what makes a motion a person's.
void AddNaturalTerms(const LatentBody& body, const LatentOptions& options, const MotionView& motion,
                     const ReachTask& task, MotionObjective& objective) {
  const int frames = motion.NumFrames();
  const auto slide = std::make_shared<ceres::CauchyLoss>(0.01 * std::sqrt(options.skate));
  const auto creep = std::make_shared<ceres::CauchyLoss>(0.03 * std::sqrt(options.creep));
  const int num_soles = static_cast<int>(body.soles.size());
  // A wrist that has to be lower than a hand is long has its hand in the floor, or bent up, which
  // the latents know nothing of.
  const bool low = !body.fingertips.empty() && task.goal.z() < body.fingertips[0].offset.norm();
  const int num_tips = low ? 0 : static_cast<int>(body.fingertips.size());
  // From frame to frame against sliding, and over a fifth of a second against creeping.
  std::vector<double> share(static_cast<std::size_t>(frames));
  for (int k = 0; k < num_soles && options.skate > 0.0; ++k) {
    const int point = kNumBodyJoints + k;
    for (int t = 0; t < frames; ++t) {
      share[static_cast<std::size_t>(t)] = FootSkate::PlantedShare(motion.At(t, point).z());
    }
    for (const int lag : {1, kCreep}) {
      const double weight = lag == 1 ? options.skate : options.creep;
      for (int t = 0; t + lag < frames && weight > 0.0; ++t) {
        const double planted = *std::min_element(share.begin() + t, share.begin() + t + lag + 1);
        if (planted <= 0.0) continue;
        objective.Add("skate", std::make_shared<FootSkate>(weight * planted),
                      lag == 1 ? slide : creep, {Position(t, point), Position(t + lag, point)});
      }
    }
  }
  const auto floor = std::make_shared<FloorContact>(-0.005, options.floor);
  const auto airborne = std::make_shared<Airborne>(
      std::vector<double>(static_cast<std::size_t>(num_soles), 0.0), 0.01, options.airborne);
  const auto speed =
      std::make_shared<PelvisSpeed>(options.fastest_m_s, kPace * kFrame, options.speed);
  const auto burst =
      std::make_shared<PelvisSpeed>(options.fastest_m_s + 0.3, kBurst * kFrame, options.speed);
  const auto smooth = std::make_shared<JointAcceleration>(kFrame, options.acceleration);
  std::array<std::shared_ptr<RotationRange>, kNumBodyJoints> range;
  for (std::size_t k = 1; k < kNumBodyJoints; ++k) {
    if (body.joint_limits[k] > 0.0 && options.limits > 0.0) {
      range[k] = std::make_shared<RotationRange>(body.joint_limits[k], options.limits);
    }
  }
  for (int t = 1; t < frames; ++t) {
    std::vector<MotionQuantity> soles;
    for (int k = 0; k < num_soles + num_tips; ++k) {
      const MotionQuantity point = Position(t, kNumBodyJoints + k);
      objective.Add("floor", floor, nullptr, {point});
      if (k < num_soles) soles.push_back(point);
    }
    objective.Add("airborne", airborne, nullptr, std::move(soles));
    if (t >= kBurst) {
      objective.Add("speed", burst, nullptr, {Position(t - kBurst, 0), Position(t, 0)});
    }
    if (t >= kPace)
      objective.Add("speed", speed, nullptr, {Position(t - kPace, 0), Position(t, 0)});
    if (options.acceleration > 0.0 && t + 1 < frames) {
      for (int k = 0; k < kNumBodyJoints; ++k) {
        objective.Add("acceleration", smooth, nullptr,
                      {Position(t - 1, k), Position(t, k), Position(t + 1, k)});
      }
    }
    for (int k = 1; k < kNumBodyJoints; ++k) {
      if (range[static_cast<std::size_t>(k)] != nullptr) {
        objective.Add("limits", range[static_cast<std::size_t>(k)], nullptr, {LocalRotation(t, k)});
      }
    }
  }
  if (options.balance > 0.0) {
    const auto balance = std::make_shared<StandingBalance>(0.05, options.balance);
    std::vector<int> joints;
    for (const auto& mass : StandingBalance::kMasses) joints.push_back(mass.first);
    joints.insert(joints.end(), StandingBalance::kFeet.begin(), StandingBalance::kFeet.end());
    for (int t = 1; t < frames; ++t) {
      // Who arrives stands; else who hardly moves does.
      const bool arrived =
          t >= task.deadline - kArriving && t <= task.deadline + options.hold_frames;
      const int before = std::max(0, t - kPace), after = std::min(frames - 1, t + kPace);
      const Eigen::Vector3d way = motion.At(after, 0) - motion.At(before, 0);
      if (!arrived && way.head<2>().norm() > kStandsStill * (after - before) * kFrame) continue;
      std::vector<MotionQuantity> blocks;
      for (const int joint : joints) blocks.push_back(Position(t, joint));
      objective.Add("balance", balance, nullptr, std::move(blocks));
    }
  }
  for (const LatentObstacle& obstacle : options.obstacles) {
    // About how thick a person is around each joint, metres; the reaching arm may touch.
    for (int k = 0; k < kNumBodyJoints; ++k) {
      const double thickness =
          k <= 15 ? (k == 7 || k == 8 || k == 10 || k == 11 ? 0.06 : 0.13) : 0.05;
      const auto keep_out =
          std::make_shared<Obstacle>(*obstacle.solid, thickness, options.obstacle);
      if (k == GoalJoint(options)) continue;
      for (int t = 1; t < frames; ++t)
        objective.Add("obstacle", keep_out, nullptr, {Position(t, k)});
    }
  }
  if (options.near > 0.0) {
    const int first = std::max(1, task.deadline - 3 * kArriving);
    const int last = std::min(frames - 1, task.deadline + options.hold_frames);
    const auto near = std::make_shared<StandNear>(task.goal, options.farthest_stance_m,
                                                  options.near / (last - first + 1));
    for (int t = first; t <= last; ++t) objective.Add("near", near, nullptr, {Position(t, 0)});
  }
  if (options.path > 0.0) {
    const Eigen::Vector3d from = motion.At(0, 0);
    const Eigen::Vector2d way = (task.goal - from).head<2>();
    const Eigen::Vector2d stop = from.head<2>() + way * std::max(0.0, 1.0 - 0.45 / way.norm());
    for (int t = 1; t < std::min(frames, task.deadline); t += 5) {
      const double u = static_cast<double>(t) / std::max(1, task.deadline - 20);
      const Eigen::Vector2d at = from.head<2>() + std::min(u, 1.0) * (stop - from.head<2>());
      objective.Add("path", std::make_shared<PelvisPath>(at, options.path),
                    std::make_shared<ceres::CauchyLoss>(0.5), {Position(t, 0)});
    }
  }
  if (options.look > 0.0) {
    const auto look = std::make_shared<LookAt>(task.goal, options.look);
    for (int t = std::max(1, task.deadline - 45); t <= std::min(task.deadline, frames - 1);
         t += 3) {
      objective.Add("look", look, nullptr, {WorldRotation(t, kHeadJoint), Position(t, kHeadJoint)});
    }
  }
}

void AddGoalTerms(const LatentOptions& options, const ReachTask& task, double share_done,
                  int frames, MotionObjective& objective) {
  const int joint = GoalJoint(options);
  const int elbow = kJointParents[WristJoint(options.intention.wrist)];
  if (options.free_time) {
    const int last = std::min(frames - 1, task.deadline + options.late_frames);
    std::vector<MotionQuantity> window;
    for (int t = 1; t <= last; ++t) window.push_back(Position(t, joint));
    const double tau =
        options.soft_min_from_m *
        std::pow(options.soft_min_to_m / options.soft_min_from_m, std::min(1.0, 2.0 * share_done));
    const int count = static_cast<int>(window.size());
    objective.Add("goal", std::make_shared<FirstArrival>(task.goal, count, tau, options.goal),
                  nullptr, std::move(window));
    return;
  }
  const int last = std::min(frames - 1, task.deadline + options.hold_frames);
  const int first = std::min(task.deadline, last);
  const double each = options.goal / (last - first + 1);
  const auto goal = std::make_shared<JointGoal>(task.goal, each);
  for (int t = first; t <= last; ++t) objective.Add("goal", goal, nullptr, {Position(t, joint)});
  if (options.approach) {
    const auto approach = std::make_shared<ApproachDirection>(
        *options.approach, options.direction / (last - first + 1));
    for (int t = first; t <= last; ++t) {
      objective.Add("direction", approach, nullptr,
                    {Position(t, elbow), Position(t, WristJoint(options.intention.wrist))});
    }
  }
}

// One task on its way.
struct Traveller {
  const ReachTask* task = nullptr;
  int index = 0;
  Eigen::VectorXf centre, latents, mean, variance, gradient;
  int steps = 0;
  MotionView motion;
  MotionObjective natural;
  int contacts_age = kContactsEvery;
  double closest_m = INFINITY, last_m = INFINITY, goal_error_m = INFINITY;
  int arrival = 0;  // frame of the least distance
  // Gauss-Newton
  double radius = 0.15;
  double value = INFINITY;
  int refusals = 0;
  bool done = false;
};

// Runs some travellers side by side through rollout, objective and back.
class Passage {
 public:
  Passage(const wandr::Network<float>& network, const LatentBody& body,
          const LatentOptions& options, int num_steps, int capacity)
      : body_(body),
        bones_(body.bones.Cast<double>()),
        options_(options),
        steps_(num_steps),
        latent_size_(network.LatentSize()),
        rollout_(network, body.bones, capacity, num_steps, {options.intention}, true) {}

  void Forward(std::span<Traveller* const> travellers, bool trial = false) {
    std::vector<wandr::RolloutStart<float>> starts;
    std::vector<wandr::GoalPlan> plans;
    for (const Traveller* one : travellers) {
      starts.push_back(one->task->start);
      plans.push_back(options_.with_intention
                          ? wandr::GoalPlan{{one->task->goal, one->task->deadline}}
                          : wandr::GoalPlan{});
    }
    const auto count = static_cast<Eigen::Index>(travellers.size());
    rollout_.Begin(starts, plans);
    Eigen::MatrixXf step(latent_size_, count);
    for (int t = 0; t < steps_; ++t) {
      for (Eigen::Index i = 0; i < count; ++i) {
        const Eigen::VectorXf& z = travellers[static_cast<std::size_t>(i)]->latents;
        step.col(i) = z.segment(static_cast<Eigen::Index>(t) * latent_size_, latent_size_);
      }
      rollout_.Step(step);
    }
    const int joint = GoalJoint(options_);
    for (std::size_t i = 0; i < travellers.size(); ++i) {
      Traveller& one = *travellers[i];
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
      // What the goal term sees: the worst while the wrist is to stay.
      one.goal_error_m = one.closest_m;
      if (!options_.free_time) {
        one.arrival = std::min(one.task->deadline, steps_);
        one.goal_error_m = (one.motion.At(one.arrival, joint) - one.task->goal).norm();
      }
      if (trial) continue;
      if (++one.contacts_age > kContactsEvery) {
        one.natural.Clear();
        AddNaturalTerms(body_, options_, one.motion, *one.task, one.natural);
        one.contacts_age = 1;
      }
    }
  }

  /// Value of the whole objective but for the prior; gradient with respect to latents.
  void Gradient(std::span<Traveller* const> travellers, double share_done) {
    const auto count = static_cast<Eigen::Index>(travellers.size());
    Prepare(count);
    MotionGradient motion_bar;
    for (Eigen::Index i = 0; i < count; ++i) {
      Traveller& one = *travellers[static_cast<std::size_t>(i)];
      MotionObjective goal;
      AddGoalTerms(options_, *one.task, share_done, steps_ + 1, goal);
      motion_bar.SetZero(steps_ + 1);
      one.value = goal.Evaluate(one.motion, &motion_bar);
      one.value += one.natural.Evaluate(one.motion, &motion_bar);
      Put(motion_bar, i);
    }
    rollout_.Backward(seed_, 1, gradient_);
    for (Eigen::Index i = 0; i < count; ++i) {
      Traveller& one = *travellers[static_cast<std::size_t>(i)];
      one.gradient = gradient_.latents.col(i);
      one.value += LatentPrior::AddGradient(one.latents, one.centre, options_.prior, one.gradient);
    }
  }

  /// Rows of the dual Gauss-Newton system, for each traveller: the goal's three coordinates at its
  /// arrival, and the square root of the rest. `J`: per traveller (64 T x 4), `r`: 4.
  void Rows(std::span<Traveller* const> travellers, double sigma_m, double penalty_scale,
            std::vector<Eigen::MatrixXf>& J, std::vector<Eigen::Vector4d>& r) {
    const auto count = static_cast<Eigen::Index>(travellers.size());
    Prepare(4 * count);
    J.resize(travellers.size());
    r.resize(travellers.size());
    MotionGradient motion_bar;
    const int joint = GoalJoint(options_);
    for (Eigen::Index i = 0; i < count; ++i) {
      Traveller& one = *travellers[static_cast<std::size_t>(i)];
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

  wandr::RolloutTrack TrackOf(std::size_t i) const {
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

  double Natural(const Traveller& one) const { return one.natural.Evaluate(one.motion); }

 private:
  void Prepare(Eigen::Index columns) {
    seed_.joints.resize(static_cast<std::size_t>(steps_) + 1);
    seed_.poses.resize(static_cast<std::size_t>(steps_) + 1);
    for (auto& joints : seed_.joints) joints.resize(wandr::kJointNumbers, columns);
    for (auto& poses : seed_.poses) poses.resize(wandr::kTangentSize, columns);
  }
  void Put(const MotionGradient& bar, Eigen::Index column) {
    for (int t = 0; t <= steps_; ++t) {
      seed_.joints[static_cast<std::size_t>(t)].col(column) = bar.joints.col(t).cast<float>();
      seed_.poses[static_cast<std::size_t>(t)].col(column) = bar.poses.col(t).cast<float>();
    }
  }

  const LatentBody& body_;
  wandr::BoneOffsets<double> bones_;
  const LatentOptions& options_;
  int steps_;
  Eigen::Index latent_size_;
  wandr::Rollout<float> rollout_;
  wandr::RolloutSeed<float> seed_;
  wandr::RolloutGradient<float> gradient_;
};

void AdamStep(Traveller& one, double rate) {
  constexpr float kMean = 0.9f, kVariance = 0.99f;
  ++one.steps;
  one.mean = kMean * one.mean + (1.0f - kMean) * one.gradient;
  one.variance = kVariance * one.variance + (1.0f - kVariance) * one.gradient.cwiseAbs2();
  const auto mean_scale = static_cast<float>(rate / (1.0 - std::pow(kMean, one.steps)));
  const auto variance_scale = static_cast<float>(1.0 / (1.0 - std::pow(kVariance, one.steps)));
  one.latents.array() -=
      mean_scale * one.mean.array() / ((variance_scale * one.variance.array()).sqrt() + 1e-12f);
}

std::vector<Traveller*> Pointers(std::vector<Traveller>& all) {
  std::vector<Traveller*> out;
  for (Traveller& one : all) {
    if (!one.done) out.push_back(&one);
  }
  return out;
}

void Record(Traveller& one, ReachTrace& trace, double seconds) {
  trace.closest_m.push_back(static_cast<float>(one.closest_m));
  trace.last_m.push_back(static_cast<float>(one.last_m));
  trace.seconds.push_back(static_cast<float>(seconds));
}

// dz = -W J^T (kappa I + J W J^T)^-1 r, W one weight per step: 1 / (|J_t| + 0.05 mean |J|), mean 1.
Eigen::VectorXf DualStep(const Eigen::MatrixXf& J, const Eigen::Vector4d& r, double kappa,
                         Eigen::Index latent_size) {
  const Eigen::Index steps = J.rows() / latent_size;
  Eigen::VectorXd norms(steps);
  for (Eigen::Index t = 0; t < steps; ++t) {
    norms[t] = J.middleRows(t * latent_size, latent_size).leftCols<3>().norm();
  }
  Eigen::VectorXd weights = (norms.array() + 0.05 * norms.mean() + 1e-12).inverse();
  weights /= weights.mean();
  Eigen::MatrixXf WJ = J;
  for (Eigen::Index t = 0; t < steps; ++t) {
    WJ.middleRows(t * latent_size, latent_size) *= static_cast<float>(weights[t]);
  }
  Eigen::Matrix4d gram = (J.transpose() * WJ).cast<double>();
  gram.diagonal().array() += kappa;
  const Eigen::Vector4d dual = gram.ldlt().solve(r);
  return -(WJ * dual.cast<float>());
}

class Batch {
 public:
  Batch(const wandr::Network<float>& network, const LatentBody& body,
        std::span<const ReachTask> tasks, const LatentOptions& options)
      : options_(options),
        latent_size_(network.LatentSize()),
        steps_(tasks[0].num_steps),
        passage_(network, body, options, steps_, static_cast<int>(tasks.size())),
        solutions_(tasks.size()),
        started_(Clock::now()) {
    std::vector<BodyPoint> points = body.soles;
    points.insert(points.end(), body.fingertips.begin(), body.fingertips.end());
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      Traveller one;
      one.task = &tasks[i];
      one.index = static_cast<int>(i);
      one.motion = MotionView(points);
      one.centre =
          wandr::DrawLatents(tasks[i].seed, tasks[i].stream, network.LatentSize(), steps_, 1.0);
      one.latents = one.centre;
      one.mean.setZero(one.centre.size());
      one.variance.setZero(one.centre.size());
      travellers_.push_back(std::move(one));
    }
  }

  std::vector<ReachSolution> Run() {
    Adam();
    GaussNewton();
    std::vector<Traveller*> all;
    for (Traveller& one : travellers_) all.push_back(&one);
    passage_.Forward(all, true);
    for (std::size_t i = 0; i < all.size(); ++i) {
      solutions_[i].track = passage_.TrackOf(i);
      solutions_[i].latents = all[i]->latents;
    }
    return std::move(solutions_);
  }

 private:
  double Seconds() const {
    return std::chrono::duration<double>(Clock::now() - started_).count() /
           static_cast<double>(travellers_.size());
  }

  void Adam() {
    for (int iteration = 0; iteration <= options_.adam_iterations; ++iteration) {
      const std::vector<Traveller*> moving = Pointers(travellers_);
      if (moving.empty()) break;
      if (options_.poll) options_.poll();
      passage_.Forward(moving);
      const double seconds = Seconds();
      for (Traveller* one : moving) {
        Record(*one, solutions_[static_cast<std::size_t>(one->index)].trace, seconds);
        one->done =
            iteration == options_.adam_iterations || (iteration >= options_.least_iterations &&
                                                      one->goal_error_m <= options_.close_enough_m);
      }
      const double share = static_cast<double>(iteration) / std::max(1, options_.adam_iterations);
      passage_.Gradient(moving, share);
      const double rate = options_.adam_step * (1.0 - 0.95 * share);
      for (Traveller* one : moving) {
        if (!one->done) AdamStep(*one, rate);
      }
    }
    for (Traveller& one : travellers_) one.done = false;
  }

  void GaussNewton() {
    // A centimetre off the goal counts as much as what moves five on the way there.
    constexpr double kSigma = 0.01, kKappa = 1e-2, kLess = 0.05;
    constexpr double penalty_scale = 1.0 / (0.05 * 0.05);
    const auto size = static_cast<double>(latent_size_) * steps_;
    std::vector<Eigen::MatrixXf> J;
    std::vector<Eigen::Vector4d> r;
    for (int iteration = 0; iteration < options_.newton_iterations; ++iteration) {
      for (Traveller& one : travellers_) {
        one.done = one.done || one.goal_error_m <= options_.newton_goal_m || one.refusals > 4;
      }
      const std::vector<Traveller*> moving = Pointers(travellers_);
      if (moving.empty()) break;
      if (options_.poll) options_.poll();
      passage_.Forward(moving, true);
      passage_.Rows(moving, kSigma, penalty_scale, J, r);
      std::vector<Eigen::VectorXf> before;
      std::vector<double> value;
      for (std::size_t i = 0; i < moving.size(); ++i) {
        Traveller& one = *moving[i];
        // The rest is no residual that can vanish: a little less of it is asked for.
        const Eigen::Vector4d wanted(r[i][0], r[i][1], r[i][2], kLess * r[i][3]);
        Eigen::VectorXf step = DualStep(J[i], wanted, kKappa, latent_size_);
        const double rms = std::sqrt(static_cast<double>(step.squaredNorm()) / size);
        if (rms > one.radius) step *= static_cast<float>(one.radius / rms);
        before.push_back(one.latents);
        value.push_back(r[i].squaredNorm());
        one.latents += step;
      }
      passage_.Forward(moving, true);
      const double seconds = Seconds();
      for (std::size_t i = 0; i < moving.size(); ++i) {
        Traveller& one = *moving[i];
        const double trial = one.goal_error_m * one.goal_error_m / (kSigma * kSigma) +
                             2.0 * penalty_scale * passage_.Natural(one);
        if (trial < value[i]) {
          one.radius *= 1.5;
          one.refusals = 0;
        } else {
          one.latents = before[i];
          one.radius *= 0.4;
          ++one.refusals;
          one.goal_error_m = r[i].head<3>().norm() * kSigma;
        }
        Record(one, solutions_[static_cast<std::size_t>(one.index)].trace, seconds);
      }
    }
  }

  const LatentOptions& options_;
  Eigen::Index latent_size_;
  int steps_;
  Passage passage_;
  std::vector<Traveller> travellers_;
  std::vector<ReachSolution> solutions_;
  Clock::time_point started_;
};

}  // namespace

LatentBody LatentBodyOf(const Eigen::Matrix3Xd& rest_joints, double sole_y) {
  LatentBody body;
  body.bones = wandr::BoneOffsetsOf(rest_joints).Cast<float>();
  // Heels and balls as the ground probe has them; toes go on for about as long as the ball is
  // half-way from the ankle, fingertips lie beyond the last knuckle of the middle finger.
  constexpr double kToes = 0.45, kFinger = 1.13;
  constexpr std::array<std::array<int, 2>, 2> kFeet = {{{7, 10}, {8, 11}}};
  constexpr std::array<std::array<int, 2>, 2> kHands = {{{20, 30}, {21, 45}}};
  BodyFrame rest;
  rest.pelvis = rest_joints.col(0);
  const Soles soles = SolePoints(rest_joints, sole_y).At(Place(rest_joints, rest));
  for (int side = 0; side < 2; ++side) {
    const auto [ankle, ball] = kFeet[static_cast<std::size_t>(side)];
    const Eigen::Vector3d heel = soles.col(2 * side) - rest_joints.col(ankle);
    const Eigen::Vector3d under_ball = soles.col(2 * side + 1) - rest_joints.col(ball);
    const double length = rest_joints(2, ball) - rest_joints(2, ankle);
    body.soles.push_back({ankle, heel});
    body.soles.push_back({ball, under_ball});
    body.soles.push_back({ball, under_ball + kToes * length * Eigen::Vector3d::UnitZ()});
    const auto [wrist, knuckle] = kHands[static_cast<std::size_t>(side)];
    body.fingertips.push_back(
        {wrist, kFinger * (rest_joints.col(knuckle) - rest_joints.col(wrist))});
  }
  body.joint_limits = CapturedJointLimits();
  return body;
}

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
  const int total = static_cast<int>(tasks.size());
  const int size =
      std::clamp((total + threads - 1) / std::max(threads, 1), 1, std::max(options.batch, 1));
  std::mutex progress_mutex;
  int done = 0;
  ParallelFor((total + size - 1) / size, threads, [&](int b) {
    const int first = b * size, count = std::min(size, total - first);
    std::vector<ReachSolution> part =
        Batch(network, body,
              tasks.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count)),
              options)
            .Run();
    std::ranges::move(part, solutions.begin() + first);
    if (!progress) return;
    const std::lock_guard lock(progress_mutex);
    progress(done += count, total);
  });
  return solutions;
}

}  // namespace holdfast
