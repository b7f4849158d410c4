// SPDX-License-Identifier: MIT
#pragma once

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

}  // namespace holdfast
