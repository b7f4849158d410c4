// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

namespace holdfast {

/// Options for sparsely coupled unknowns, such as the frames of a clip: Eigen's sparse Cholesky, so
/// the result does not depend on the installed BLAS; one thread, no messages.
ceres::Solver::Options SparseOptions(int max_iterations, double function_tolerance);

/// Options for about a hundred fully coupled unknowns: normal equations factored by Eigen, one
/// thread, no messages.
ceres::Solver::Options DenseOptions(int max_iterations, double step_tolerance,
                                    double function_tolerance);

/// Options of a problem that does not own its terms, loss functions and manifolds.
ceres::Problem::Options BorrowingProblem();

/// Number of steps tried in a solve.
int StepsOf(const ceres::Solver::Summary& summary);

/// ceres::Solve.
ceres::Solver::Summary SolveQuietly(const ceres::Solver::Options& options, ceres::Problem& problem);

/// Call once in programs, before any solve. Ceres logs to stderr through glog, whatever its
/// options, and aborts the process when one of its own checks fails. After this call it logs
/// nothing, and a failed check ends the program with exit code 1 and a message.
void QuietCeres();

/// Reports the progress of a Ceres solve as (iteration, `most`), and stops it when `progress`
/// returns false; an empty `progress` never stops it. `progress` must outlive this.
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
