// SPDX-License-Identifier: MIT
#include "solver/unknowns/ceres_solve.h"

#include <unistd.h>
#include <algorithm>
#include <cstdlib>
#include <string_view>

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

ceres::Solver::Options DenseOptions(int max_iterations, double step_tolerance,
                                    double function_tolerance) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = max_iterations;
  options.parameter_tolerance = step_tolerance;
  options.function_tolerance = function_tolerance;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

ceres::Problem::Options BorrowingProblem() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

int StepsOf(const ceres::Solver::Summary& summary) {
  // The first iteration is the start.
  return std::max(0, static_cast<int>(summary.iterations.size()) - 1);
}

ceres::Solver::Summary SolveQuietly(const ceres::Solver::Options& options,
                                    ceres::Problem& problem) {
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary;
}

}  // namespace holdfast

#if __has_include(<glog/logging.h>)
#include <glog/logging.h>
#define HOLDFAST_HAS_GLOG
#endif

namespace holdfast {
namespace {

[[noreturn]] void Fail() {
  constexpr std::string_view kText =
      "holdfast: the optimizer encountered invalid numbers. Check the units of the input with "
      "'holdfast doctor FILE'.\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kText.data(), kText.size());
  std::_Exit(1);
}

}  // namespace

void QuietCeres() {
#ifdef HOLDFAST_HAS_GLOG
  FLAGS_minloglevel = google::NUM_SEVERITIES;
  google::InstallFailureFunction(&Fail);
#endif
}

}  // namespace holdfast
