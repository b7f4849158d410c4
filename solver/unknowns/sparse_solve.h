// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/problem.h>
#include <ceres/solver.h>

namespace holdfast {

/// Options for unknowns that couple few others, as the frames of a clip: sparse Cholesky by Eigen,
/// whose result no BLAS that happens to be installed changes; one thread, no messages.
ceres::Solver::Options SparseOptions(int max_iterations, double function_tolerance);

/// ceres::Solve.
ceres::Solver::Summary SolveQuietly(const ceres::Solver::Options& options, ceres::Problem& problem);

}  // namespace holdfast
