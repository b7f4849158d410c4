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

/// Where a rollout starts.
template <typename T>
struct RolloutStart {
  Pose<T> pose;
  /// d_0, normalized: the step that led to `pose`. Not all zeros for standing still (that is the
  /// mean delta): see StartAtRest.
  StateVector<T> previous_delta = StateVector<T>::Zero();

  template <typename U>
  RolloutStart<U> Cast() const {
    return {pose.template Cast<U>(), previous_delta.template cast<U>()};
  }
};

struct RolloutOptions {
  IntentionOptions intention;
  /// Gradients take the heading's rotation Z as constant, as the authors' code does; exact if not.
  bool detached_heading = false;
};

/// Gradients of a scalar (or of rows of a residual) with respect to what a rollout of T steps
/// passed through. Each is empty, or has T + 1 entries, one per frame 0..T, of which any may be
/// empty (zero). Columns: m to each body, consecutive.
template <typename Real>
struct RolloutSeed {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  std::vector<Matrix> joints;  ///< (66 x N m), with respect to joint positions, per meter
  std::vector<Matrix> poses;   ///< (69 x N m), with respect to tangents of poses
};

/// Gradients with respect to what a rollout starts from, columns as in the seed.
template <typename Real>
struct RolloutGradient {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix latents;         ///< (64 T x N m), step t in rows 64 t ..
  Matrix start_pose;      ///< (69 x N m): dp, then phi_k of R^k Exp(phi_k)
  Matrix previous_delta;  ///< (135 x N m), normalized
  Matrix goals;           ///< (3 W x N m), W the most waypoints of any body; per meter
};

/// N bodies stepped together through the closed loop of WANDR (sec. 3.3):
///   FK(s_t) -> I_t -> c_t -> u_t = decoder(z_t, c_t) -> s_{t+1} = step(s_t, u_t), d = u_t.
/// A body's motion does not depend, to the last bit, on which others are in the batch. After
/// construction nothing is allocated by Begin (with plans no longer than before) and Step.
template <typename Real>
class Rollout {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  /// `network` must outlive it. A differentiable rollout keeps what Backward needs: 20 KB per body
  /// and step for the published decoder in single precision; any other keeps poses alone.
  Rollout(const Network<Real>& network, const BoneOffsets<Real>& bones, int max_bodies,
          int max_steps, const RolloutOptions& options = {}, bool differentiable = false);

  /// Places the bodies at frame 0. As many plans as starts.
  void Begin(std::span<const RolloutStart<Real>> starts, std::span<const GoalPlan> plans);

  /// One step of 1/30 s; `latents` is (64 x N).
  void Step(const Eigen::Ref<const Matrix>& latents);

  int NumBodies() const { return num_bodies_; }
  int NumSteps() const { return step_; }  ///< taken since Begin
  /// Poses of frame 0..NumSteps(), one per body.
  std::span<const Pose<Real>> Poses(int frame) const {
    return {poses_.data() + static_cast<std::size_t>(frame) * max_bodies_,
            static_cast<std::size_t>(num_bodies_)};
  }
  /// u_t of the last step, normalized (135 x N), or the start's before any.
  const Matrix& PreviousDelta() const { return previous_delta_; }

  /// The vector-Jacobian product of all steps taken, exact (but at kinks of the rectifiers): about
  /// the cost of the rollout, once per row. `rows` is m. `gradient` is resized when it must be.
  void Backward(const RolloutSeed<Real>& seed, int rows, RolloutGradient<Real>& gradient) const;

 private:
  Pose<Real>* PosesAt(int frame) {
    return poses_.data() + static_cast<std::size_t>(frame) * max_bodies_;
  }
  nn::Tape<Real>& Tape(int step) { return tapes_[differentiable_ ? step : 0]; }
  void WriteInput(int body, const Heading<Real>& heading, Real* condition) const;

  // Parts of Backward.
  void ResizeGradient(int rows, RolloutGradient<Real>& gradient) const;
  /// Gradients of the last frame's poses, from the seed alone.
  void SeedLastPoses(const RolloutSeed<Real>& seed, int rows, Matrix& pose_bar) const;
  /// Through step t: poses of frame t + 1 to those of frame t and to the decoder's output, which
  /// the next step has seen too.
  void StepBackward(int t, int rows, const Matrix& delta_bar, Matrix& pose_bar,
                    Matrix& output_bar) const;
  /// Through what the decoder has seen of frame t, for one body; adds the seed of the frame.
  void InputBackward(const RolloutSeed<Real>& seed, int t, int body, int rows,
                     const Matrix& input_bar, RolloutGradient<Real>& gradient) const;

  const Network<Real>& network_;
  BoneOffsets<Real> bones_;
  RolloutOptions options_;
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
  std::span<const GoalPlan> plans;  ///< as many as starts
  int num_steps = 240;              ///< T
  /// z_t ~ N(0, sigma^2 I) per motion and step. Motion i draws from stream `first_stream` + i of
  /// `seed`: a part of a larger job gives what the whole gives.
  std::uint64_t seed = 0;
  std::uint64_t first_stream = 0;
  double sigma = 1.0;
  /// Latents given instead, (64 T x N); must outlive the run.
  const Eigen::MatrixXf* latents = nullptr;
};

/// The latents (64 T) that motion `stream` of `seed` draws.
Eigen::VectorXf DrawLatents(std::uint64_t seed, std::uint64_t stream, int latent_size,
                            int num_steps, double sigma);

/// Runs N motions, some dozens at a time in each thread. The result does not depend on `threads`,
/// nor, per motion, on the others. Throws Error for unequal numbers, no motions, no steps, and
/// goals or starts that are not finite.
std::vector<RolloutTrack> RunRollouts(const Network<float>& network,
                                      const BoneOffsets<float>& bones,
                                      const RolloutRequest& request, int threads,
                                      const RolloutOptions& options = {});

/// The same without keeping them: `take(i, track)` is called once for each, from any thread,
/// several at a time; `track` is reused after it returns.
void RunRollouts(const Network<float>& network, const BoneOffsets<float>& bones,
                 const RolloutRequest& request, int threads, const RolloutOptions& options,
                 const std::function<void(int, const RolloutTrack&)>& take);

}  // namespace holdfast::wandr
