// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

namespace holdfast {

/// Options for unknowns that couple few others, as the frames of a clip: sparse Cholesky by Eigen,
/// whose result no BLAS that happens to be installed changes; one thread, no messages.
ceres::Solver::Options SparseOptions(int max_iterations, double function_tolerance);

/// Options for about a hundred unknowns that all depend on one another: normal equations factored
/// by Eigen, one thread, no messages.
ceres::Solver::Options DenseOptions(int max_iterations, double step_tolerance,
                                    double function_tolerance);

/// A problem whose terms, loss functions and manifolds others own.
ceres::Problem::Options BorrowingProblem();

/// Steps that a solve tried.
int StepsOf(const ceres::Solver::Summary& summary);

/// ceres::Solve.
ceres::Solver::Summary SolveQuietly(const ceres::Solver::Options& options, ceres::Problem& problem);

/// For programs, once, before anything is solved: Ceres reports what it meets to stderr through
/// glog, whatever its options say, and aborts the process where one of its own checks fails. After
/// this it says nothing, and a failed check ends the program with exit code 1 and a sentence.
void QuietCeres();

/// Tells how far a solve of Ceres is, as (iteration, `most`), and ends it when `progress` returns
/// false; without one, the solve goes on. `progress` must outlive it.
class StopWhenAsked final : public ceres::IterationCallback {
 public:
  StopWhenAsked(const std::function<bool(int, int)>& progress, int most)
      : progress_(progress), most_(most) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    return !progress_ || progress_(summary.iteration, most_) ? ceres::SOLVER_CONTINUE
                                                             : ceres::SOLVER_ABORT;
  }

 private:
  const std::function<bool(int, int)>& progress_;
  int most_;
};

}  // namespace holdfast
