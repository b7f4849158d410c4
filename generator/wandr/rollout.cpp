// SPDX-License-Identifier: MIT
#include "generator/wandr/rollout.h"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

#include "generator/nn/random_stream.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"
#include "geometry/error.h"
#include "geometry/parallel.h"

namespace holdfast::wandr {

template <typename Real>
Rollout<Real>::Rollout(const Network<Real>& network, const BoneOffsets<Real>& bones, int max_bodies,
                       int max_steps, const IntentionOptions& intention, bool differentiable)
    : network_(network),
      bones_(bones),
      intention_(intention),
      max_bodies_(max_bodies),
      max_steps_(max_steps),
      differentiable_(differentiable),
      poses_(static_cast<std::size_t>(max_bodies) * (max_steps + 1)),
      plans_(max_bodies),
      headings_(max_bodies),
      previous_delta_(kStateSize, max_bodies),
      tapes_(differentiable ? std::max(max_steps, 1) : 1,
             nn::Tape<Real>(network.Decoder(), max_bodies)) {}

template <typename Real>
void Rollout<Real>::Begin(std::span<const RolloutStart<Real>> starts,
                          std::span<const GoalPlan> plans) {
  assert(static_cast<int>(starts.size()) <= max_bodies_ && plans.size() == starts.size());
  num_bodies_ = static_cast<int>(starts.size());
  step_ = 0;
  if (previous_delta_.cols() != num_bodies_) previous_delta_.resize(kStateSize, num_bodies_);
  for (int i = 0; i < num_bodies_; ++i) {
    PosesAt(0)[i] = starts[i].pose;
    previous_delta_.col(i) = starts[i].previous_delta;
    plans_[i] = plans[i];
  }
  for (nn::Tape<Real>& tape : tapes_) tape.Resize(num_bodies_);
}

template <typename Real>
FrameGoal<Real> Rollout<Real>::GoalOf(int body, int frame, const Vector3<Real>& pelvis) const {
  constexpr double kFewest = 5.0;  // frames, of a person who stands at the goal
  FrameGoal<Real> goal = GoalAt<Real>(plans_[body], frame, intention_);
  if (goal.active && intention_.pace_m_s > 0.0) {
    const double way = (goal.position - pelvis).template head<2>().norm();
    goal.frames_left = std::min(
        goal.frames_left, Real(std::max(kFramesPerSecond * way / intention_.pace_m_s, kFewest)));
  }
  return goal;
}

template <typename Real>
void Rollout<Real>::WriteInput(int body, const Heading<Real>& heading, Real* condition) const {
  const Pose<Real>& pose = Poses(step_)[body];
  WritePoseFeatures(pose, heading, network_.Norms(), condition);
  std::copy_n(previous_delta_.col(body).data(), kStateSize, condition + kPreviousDeltaOf);
  IntentionBody<Real> seen{heading, pose.translation + bones_.offset.col(0), {}};
  const FrameGoal<Real> goal = GoalOf(body, step_, seen.pelvis);
  if (goal.active) seen.wrist = WristPosition(bones_, pose, intention_.wrist);
  WriteIntention(network_.Layout(), seen, goal, condition + kIntentionOf);
}

template <typename Real>
void Rollout<Real>::Step(const Eigen::Ref<const Matrix>& latents) {
  assert(step_ < max_steps_ && latents.cols() == num_bodies_);
  const int latent_size = network_.LatentSize();
  nn::Tape<Real>& tape = Tape(step_);
  auto input = tape.Input();
  for (int i = 0; i < num_bodies_; ++i) {
    Real* const column = input.col(i).data();
    std::copy_n(latents.col(i).data(), latent_size, column);
    headings_[i] = HeadingOf<Real>(Poses(step_)[i].rotation[0]);
    WriteInput(i, headings_[i], column + latent_size);
  }
  network_.Decoder().Forward(tape);
  previous_delta_ = tape.Output();
  for (int i = 0; i < num_bodies_; ++i) {
    const StateVector<Real> delta =
        DeltaOfNormalized<Real>(network_.Norms(), previous_delta_.col(i));
    ApplyDelta<Real>(PosesAt(step_)[i], headings_[i], delta, PosesAt(step_ + 1)[i]);
  }
  ++step_;
}

namespace {

// Adds the seed at `frame` for column c: poses directly, joints into joints_bar.
template <typename Real>
bool AddSeed(const RolloutSeed<Real>& seed, int frame, int c, TangentVector<Real>& pose_bar,
             BodyJoints<Real>& joints_bar) {
  if (!seed.poses.empty() && seed.poses[frame].size() > 0) pose_bar += seed.poses[frame].col(c);
  if (seed.joints.empty() || seed.joints[frame].size() == 0) return false;
  joints_bar += Eigen::Map<const BodyJoints<Real>>(seed.joints[frame].col(c).data());
  return true;
}

}  // namespace

template <typename Real>
void Rollout<Real>::SeedLastPoses(const RolloutSeed<Real>& seed, int rows, Matrix& pose_bar) const {
  BodyKinematics<Real> kinematics;
  for (int i = 0; i < num_bodies_; ++i) {
    ForwardKinematics(bones_, Poses(step_)[i], kinematics);
    for (int c = i * rows; c < (i + 1) * rows; ++c) {
      TangentVector<Real> bar = TangentVector<Real>::Zero();
      BodyJoints<Real> joints_bar = BodyJoints<Real>::Zero();
      if (AddSeed(seed, step_, c, bar, joints_bar)) {
        ForwardKinematicsVjp<Real>(kinematics, joints_bar, bar);
      }
      pose_bar.col(c) = bar;
    }
  }
}

template <typename Real>
void Rollout<Real>::StepBackward(int t, int rows, const Matrix& delta_bar, Matrix& pose_bar,
                                 Matrix& output_bar) const {
  const nn::Tape<Real>& tape = tapes_[t];
  for (int c = 0; c < num_bodies_ * rows; ++c) {
    const Pose<Real>& pose = Poses(t)[c / rows];
    const StateVector<Real> delta =
        DeltaOfNormalized<Real>(network_.Norms(), tape.Output().col(c / rows));
    TangentVector<Real> bar = TangentVector<Real>::Zero();
    StateVector<Real> step_bar;
    ApplyDeltaVjp<Real>(HeadingOf<Real>(pose.rotation[0]), delta, pose_bar.col(c), bar, step_bar);
    pose_bar.col(c) = bar;
    output_bar.col(c) = step_bar.cwiseProduct(network_.Norms().delta.deviation) + delta_bar.col(c);
  }
}

template <typename Real>
void Rollout<Real>::InputBackward(const RolloutSeed<Real>& seed, int t, int body, int rows,
                                  const Matrix& input_bar, RolloutGradient<Real>& gradient) const {
  const int wrist = WristJoint(intention_.wrist);
  const Pose<Real>& pose = Poses(t)[body];
  const Heading<Real> heading = HeadingOf<Real>(pose.rotation[0]);
  BodyKinematics<Real> kinematics;
  ForwardKinematics(bones_, pose, kinematics);
  const int waypoint = ActiveWaypoint(plans_[body], t, intention_);
  const IntentionBody<Real> seen{heading, kinematics.joints.col(0), kinematics.joints.col(wrist)};
  const FrameGoal<Real> goal = GoalOf(body, t, seen.pelvis);
  for (int c = body * rows; c < (body + 1) * rows; ++c) {
    const Real* const condition_bar = input_bar.col(c).data() + network_.LatentSize();
    TangentVector<Real> bar = gradient.start_pose.col(c);
    WritePoseFeaturesVjp<Real>(pose, heading, network_.Norms(), condition_bar, bar);
    gradient.previous_delta.col(c) =
        Eigen::Map<const StateVector<Real>>(condition_bar + kPreviousDeltaOf);

    BodyJoints<Real> joints_bar = BodyJoints<Real>::Zero();
    bool any = AddSeed(seed, t, c, bar, joints_bar);
    if (goal.active) {
      IntentionBar<Real> intention;
      WriteIntentionVjp(network_.Layout(), seen, goal, condition_bar + kIntentionOf, intention);
      joints_bar.col(0) += intention.pelvis;
      joints_bar.col(wrist) += intention.wrist;
      bar.template segment<3>(TangentOf(0)) += intention.turn * heading.gradient;
      gradient.goals.template block<3, 1>(3 * waypoint, c) += intention.goal;
      any = true;
    }
    if (any) ForwardKinematicsVjp<Real>(kinematics, joints_bar, bar);
    gradient.start_pose.col(c) = bar;
  }
}

template <typename Real>
void Rollout<Real>::Backward(const RolloutSeed<Real>& seed, int rows,
                             RolloutGradient<Real>& gradient) const {
  assert(differentiable_);
  assert(seed.joints.empty() || static_cast<int>(seed.joints.size()) == step_ + 1);
  assert(seed.poses.empty() || static_cast<int>(seed.poses.size()) == step_ + 1);
  const int columns = num_bodies_ * rows, latent_size = network_.LatentSize();
  std::size_t waypoints = 0;
  for (int i = 0; i < num_bodies_; ++i) waypoints = std::max(waypoints, plans_[i].size());
  gradient.latents.resize(static_cast<Eigen::Index>(latent_size) * step_, columns);
  gradient.start_pose.resize(kTangentSize, columns);
  gradient.previous_delta.setZero(kStateSize, columns);
  gradient.goals.setZero(static_cast<Eigen::Index>(3 * waypoints), columns);

  Matrix& pose_bar = gradient.start_pose;       // of frame t + 1, then of frame t
  Matrix& delta_bar = gradient.previous_delta;  // of u_t as the previous delta of step t + 1
  SeedLastPoses(seed, rows, pose_bar);

  nn::Scratch<Real> scratch(network_.Decoder(), columns);
  Matrix output_bar(kStateSize, columns), input_bar(network_.Decoder().InputSize(), columns);
  for (int t = step_ - 1; t >= 0; --t) {
    StepBackward(t, rows, delta_bar, pose_bar, output_bar);
    network_.Decoder().Backward(tapes_[t], output_bar, input_bar, scratch);
    gradient.latents.middleRows(static_cast<Eigen::Index>(latent_size) * t, latent_size) =
        input_bar.topRows(latent_size);
    for (int i = 0; i < num_bodies_; ++i) InputBackward(seed, t, i, rows, input_bar, gradient);
  }
}

template class Rollout<float>;
template class Rollout<double>;

namespace {

// Large enough for products to be compute-bound, small enough for activations to fit the cache.
constexpr int kBatch = 48;

void Check(const RolloutRequest& request, const Network<float>& network) {
  const std::size_t count = request.starts.size();
  if (count == 0 || request.num_steps < 1) {
    throw Error("rollout", fmt::format("{} motions of {} steps", count, request.num_steps),
                "Request at least one motion of at least one step");
  }
  if (request.plans.size() != count) {
    throw Error("rollout", fmt::format("{} goals for {} starts", request.plans.size(), count),
                "Give one plan per start (an empty one for motion without a goal)");
  }
  if (request.latents &&
      (request.latents->cols() != static_cast<Eigen::Index>(count) ||
       request.latents->rows() != Eigen::Index{network.LatentSize()} * request.num_steps)) {
    throw Error(
        "rollout",
        fmt::format("latents are {} x {}, {} x {} are needed", request.latents->rows(),
                    request.latents->cols(), network.LatentSize() * request.num_steps, count),
        "Give one column per motion, with all steps stacked");
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!StateOf(request.starts[i].pose).allFinite() ||
        !request.starts[i].previous_delta.allFinite()) {
      throw Error(fmt::format("rollout[{}]", i), "the start pose is not finite",
                  "Check the clip it comes from");
    }
    for (const Waypoint& waypoint : request.plans[i]) {
      if (!waypoint.position.allFinite()) {
        throw Error(fmt::format("rollout[{}]", i), "the goal is not finite",
                    "Give three numbers, meters");
      }
    }
  }
}

}  // namespace

Eigen::VectorXf DrawLatents(std::uint64_t seed, std::uint64_t stream, int latent_size,
                            int num_steps, double sigma) {
  Eigen::VectorXf latents(Eigen::Index{latent_size} * num_steps);
  nn::RandomStream random(seed, stream);
  for (float& latent : latents) latent = static_cast<float>(sigma * random.Normal());
  return latents;
}

void RunRollouts(const Network<float>& network, const BoneOffsets<float>& bones,
                 const RolloutRequest& request, int threads, const IntentionOptions& intention,
                 const std::function<void(int, const RolloutTrack&)>& take) {
  Check(request, network);
  const int count = static_cast<int>(request.starts.size()), steps = request.num_steps;
  const int batch = std::clamp((count + threads - 1) / std::max(threads, 1), 1, kBatch);
  const int num_batches = (count + batch - 1) / batch;
  const int latent_size = network.LatentSize();
  // Each worker processes every n-th batch, so that it allocates its memory once.
  const int workers = std::clamp(threads, 1, num_batches);
  ParallelFor(workers, workers, [&](int worker) {
    Rollout<float> rollout(network, bones, batch, steps, intention);
    RolloutTrack track{StateMatrix<float>(kStateSize, steps + 1),
                       Eigen::MatrixXf(kJointNumbers, steps + 1)};
    Eigen::MatrixXf latents(Eigen::Index{latent_size} * steps, batch);
    Eigen::MatrixXf step_latents(latent_size, batch);
    BodyKinematics<float> kinematics;
    for (int b = worker; b < num_batches; b += workers) {
      const int first = b * batch, size = std::min(batch, count - first);
      for (int i = 0; i < size; ++i) {
        latents.col(i) = request.latents
                             ? request.latents->col(first + i).eval()
                             : DrawLatents(request.seed, request.first_stream + first + i,
                                           latent_size, steps, request.sigma);
      }
      rollout.Begin(request.starts.subspan(first, size), request.plans.subspan(first, size));
      for (int t = 0; t < steps; ++t) {
        step_latents.leftCols(size) =
            latents.block(Eigen::Index{latent_size} * t, 0, latent_size, size);
        rollout.Step(step_latents.leftCols(size));
      }
      for (int i = 0; i < size; ++i) {
        for (int t = 0; t <= steps; ++t) {
          const Pose<float>& pose = rollout.Poses(t)[i];
          WriteState<float>(pose, track.states.col(t));
          ForwardKinematics(bones, pose, kinematics);
          Eigen::Map<BodyJoints<float>>(track.joints.col(t).data()) = kinematics.joints;
        }
        take(first + i, track);
      }
    }
  });
}

std::vector<RolloutTrack> RunRollouts(const Network<float>& network,
                                      const BoneOffsets<float>& bones,
                                      const RolloutRequest& request, int threads,
                                      const IntentionOptions& intention) {
  std::vector<RolloutTrack> tracks(request.starts.size());
  RunRollouts(network, bones, request, threads, intention,
              [&](int i, const RolloutTrack& track) { tracks[i] = track; });
  return tracks;
}

}  // namespace holdfast::wandr
