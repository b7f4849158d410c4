// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "solver/fit/clip_solver.h"
#include "solver/fit/hand_object_block.h"
#include "solver/fit/hold_terms.h"
#include "solver/hand/hand_landmarks.h"

namespace holdfast {

/// Cost of one hand holding the object in one frame of a clip: the unknowns, and residuals and
/// Jacobians of its HandObjectBlock from the last HoldEvaluation. Parameter blocks: q (4), T (3), P
/// (45), with `moves` also C (4) and c (3) as in WristOffsetBlock.
class HoldCost final : public ceres::CostFunction {
 public:
  /// `frame_state` must outlive this.
  HoldCost(int hold, int frame, const FittedFrame& frame_state, int hand, bool moves);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  int hold, frame;
  const double* orientation;  // of the frame's object, shared by both hands
  const double* translation;
  JointPose body;  ///< of the frame, with the arm at `offset`
  FingerPose fingers;
  WristOffset step;  ///< relative to the body
  bool moves;
  std::vector<Slip::Mark> marks;  ///< contacts in the preceding frame, with slip
  Energies energies;

 private:
  friend class HoldEvaluation;
  bool finite_ = false;
  std::array<double, HandObjectBlock::kRows> residuals_;
  std::vector<double> jacobians_;
};

/// Evaluates all frames of all holds before Ceres requests them: in parallel, with one hand state
/// of either side per thread. The result is bitwise independent of the number of threads.
class HoldEvaluation final : public ceres::EvaluationCallback {
 public:
  /// The arguments must outlive this.
  HoldEvaluation(const ClipProblem& problem, const FitOptions& options, int threads);
  ~HoldEvaluation() override;

  const HandAxes& Axes(std::size_t hand) const { return anatomy_[hand]->axes; }
  /// In frame order; may be extended until the first evaluation.
  std::vector<std::unique_ptr<HoldCost>>& Frames() { return frames_; }
  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;
  /// Makes the current positions of slipping contacts the previous ones of the following frames.
  void MarkContacts();
  /// Evaluates the energies of every held frame at the current unknowns.
  void EvaluateAll();

 private:
  struct Worker;
  using Workers = std::vector<std::unique_ptr<Worker>>;  // one per hand
  void Evaluate(Worker& worker, HoldCost& held) const;

  const ClipProblem& problem_;
  const FitOptions& options_;
  int threads_;
  std::vector<std::unique_ptr<HandAnatomy>> anatomy_;  // per hand
  std::vector<std::unique_ptr<HoldTerms>> terms_;      // per hold
  std::vector<std::unique_ptr<HoldCost>> frames_;
  std::mutex mutex_;
  std::vector<Workers> workers_;  // those not in use
  bool evaluated_ = false;
};

}  // namespace holdfast
