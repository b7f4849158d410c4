// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/goal_plan.h"
#include "generator/wandr/network.h"
#include "generator/wandr/pose.h"

namespace holdfast::wandr {

/// Initial state of a rollout.
template <typename T>
struct RolloutStart {
  Pose<T> pose;
  /// d_0, normalized: the delta that led to `pose`. Zeros are the mean delta, not a body at rest:
  /// see StartAtRest.
  StateVector<T> previous_delta = StateVector<T>::Zero();

  template <typename U>
  RolloutStart<U> Cast() const {
    return {pose.template Cast<U>(), previous_delta.template cast<U>()};
  }
};

/// Gradients of a scalar (or of rows of a residual) with respect to the frames of a rollout of T
/// steps. Each member is empty or has T + 1 entries, one per frame 0..T, any of which may be empty
/// (zero). m consecutive columns per body.
template <typename Real>
struct RolloutSeed {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  std::vector<Matrix> joints;  ///< (66 x N m), with respect to joint positions, per meter
  std::vector<Matrix> poses;   ///< (69 x N m), with respect to pose tangents
};

/// Gradients with respect to the inputs of a rollout; columns as in the seed.
template <typename Real>
struct RolloutGradient {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix latents;         ///< (64 T x N m), step t in rows 64 t ..
  Matrix start_pose;      ///< (69 x N m): dp, then phi_k of R^k Exp(phi_k)
  Matrix previous_delta;  ///< (135 x N m), normalized
  Matrix goals;           ///< (3 W x N m), W the maximum number of waypoints; per meter
};

/// N bodies stepped together through the closed loop of WANDR (sec. 3.3):
///   FK(s_t) -> I_t -> c_t -> u_t = decoder(z_t, c_t) -> s_{t+1} = step(s_t, u_t), d = u_t.
/// A body's motion does not depend on the other bodies in the batch, bit for bit. After
/// construction, Begin (with plans no longer than before) and Step do not allocate.
template <typename Real>
class Rollout {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  /// `network` must outlive the rollout. A differentiable rollout stores what Backward needs: 20 KB
  /// per body and step for the published decoder in single precision. Others store only poses.
  Rollout(const Network<Real>& network, const BoneOffsets<Real>& bones, int max_bodies,
          int max_steps, const IntentionOptions& intention = {}, bool differentiable = false);

  /// Places the bodies at frame 0. Requires one plan per start.
  void Begin(std::span<const RolloutStart<Real>> starts, std::span<const GoalPlan> plans);

  /// Advances by 1/30 s; `latents` is (64 x N).
  void Step(const Eigen::Ref<const Matrix>& latents);

  int NumSteps() const { return step_; }  ///< since Begin
  /// Poses of frame 0..NumSteps(), one per body.
  std::span<const Pose<Real>> Poses(int frame) const {
    return {poses_.data() + static_cast<std::size_t>(frame) * max_bodies_,
            static_cast<std::size_t>(num_bodies_)};
  }
  /// u_t of the last step, normalized (135 x N), or that of the start before the first step.
  const Matrix& PreviousDelta() const { return previous_delta_; }

  /// Vector-Jacobian product of all steps, exact except at kinks of the rectifiers. Costs about as
  /// much as the rollout, once per row. `rows` is m. `gradient` is resized if needed.
  void Backward(const RolloutSeed<Real>& seed, int rows, RolloutGradient<Real>& gradient) const;

 private:
  Pose<Real>* PosesAt(int frame) {
    return poses_.data() + static_cast<std::size_t>(frame) * max_bodies_;
  }
  nn::Tape<Real>& Tape(int step) { return tapes_[differentiable_ ? step : 0]; }
  void WriteInput(int body, const Heading<Real>& heading, Real* condition) const;

  /// The goal of a body in a frame, with its eta bounded by the pace.
  FrameGoal<Real> GoalOf(int body, int frame, const Vector3<Real>& pelvis) const;

  // Parts of Backward.
  /// Gradients of the poses of the last frame, from the seed only.
  void SeedLastPoses(const RolloutSeed<Real>& seed, int rows, Matrix& pose_bar) const;
  /// Through step t: from the poses of frame t + 1 to those of frame t and to the decoder output,
  /// which is also an input of the next step.
  void StepBackward(int t, int rows, const Matrix& delta_bar, Matrix& pose_bar,
                    Matrix& output_bar) const;
  /// Through the decoder inputs of frame t, for one body; adds the seed of the frame.
  void InputBackward(const RolloutSeed<Real>& seed, int t, int body, int rows,
                     const Matrix& input_bar, RolloutGradient<Real>& gradient) const;

  const Network<Real>& network_;
  BoneOffsets<Real> bones_;
  IntentionOptions intention_;
  int max_bodies_;
  int max_steps_;
  bool differentiable_;
  int num_bodies_ = 0;
  int step_ = 0;
  std::vector<Pose<Real>> poses_;  // frame by frame
  std::vector<GoalPlan> plans_;
  std::vector<Heading<Real>> headings_;
  Matrix previous_delta_;
  std::vector<nn::Tape<Real>> tapes_;  // one, or one per step
};

extern template class Rollout<float>;
extern template class Rollout<double>;

/// One motion, frames 0..T at 30 fps.
struct RolloutTrack {
  StateMatrix<float> states;  ///< (135 x T+1)
  Eigen::MatrixXf joints;     ///< (66 x T+1), world, meters
};

struct RolloutRequest {
  std::span<const RolloutStart<float>> starts;
  std::span<const GoalPlan> plans;  ///< one per start
  int num_steps = 240;              ///< T
  /// z_t ~ N(0, sigma^2 I) per motion and step. Motion i uses stream `first_stream` + i of `seed`,
  /// so a part of a larger job gives the same motions as the whole.
  std::uint64_t seed = 0;
  std::uint64_t first_stream = 0;
  double sigma = 1.0;
  /// Given latents instead of random ones, (64 T x N); must outlive the run.
  const Eigen::MatrixXf* latents = nullptr;
};

/// Returns the latents (64 T) of motion `stream` of `seed`.
Eigen::VectorXf DrawLatents(std::uint64_t seed, std::uint64_t stream, int latent_size,
                            int num_steps, double sigma);

/// Runs N motions in batches of some dozens per thread. The result does not depend on `threads`; a
/// motion does not depend on the others. Throws Error for different numbers of starts and plans, no
/// motions, no steps, and non-finite goals or starts.
std::vector<RolloutTrack> RunRollouts(const Network<float>& network,
                                      const BoneOffsets<float>& bones,
                                      const RolloutRequest& request, int threads,
                                      const IntentionOptions& intention = {});

/// Same without storing the motions: `take(i, track)` is called once per motion, concurrently from
/// several threads; `track` is reused after it returns.
void RunRollouts(const Network<float>& network, const BoneOffsets<float>& bones,
                 const RolloutRequest& request, int threads, const IntentionOptions& intention,
                 const std::function<void(int, const RolloutTrack&)>& take);

}  // namespace holdfast::wandr
