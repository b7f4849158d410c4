// SPDX-License-Identifier: MIT
#include "solver/unknowns/sparse_solve.h"

namespace holdfast {

ceres::Solver::Options SparseOptions(int max_iterations, double function_tolerance) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = function_tolerance;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

ceres::Solver::Summary SolveQuietly(const ceres::Solver::Options& options,
                                    ceres::Problem& problem) {
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary;
}

}  // namespace holdfast
