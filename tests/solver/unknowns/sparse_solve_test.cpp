// SPDX-License-Identifier: MIT
#include "solver/unknowns/ceres_solve.h"

#include <dlfcn.h>

#include <filesystem>
#include <iterator>

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "geometry/parallel.h"

namespace holdfast {
namespace {

// A chain: x0 = 3, differences 1.
struct Step {
  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    residual[0] = b[0] - a[0] - 1.0;
    return true;
  }
};
struct DistanceTo3 {
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    residual[0] = x[0] - 3.0;
    return true;
  }
};

// Any BLAS would do its sums in another order.
TEST(SparseSolve, IsEigensAlone) {
  std::vector<double> x(50, 0.0);
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DistanceTo3, 1, 1>(new DistanceTo3),
                           nullptr, x.data());
  for (std::size_t k = 1; k < x.size(); ++k) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Step, 1, 1, 1>(new Step), nullptr,
                             &x[k - 1], &x[k]);
  }
  const ceres::Solver::Options options = SparseOptions(20, 1e-12);
  ASSERT_TRUE(ceres::IsSparseLinearAlgebraLibraryTypeAvailable(ceres::EIGEN_SPARSE));
  EXPECT_EQ(options.sparse_linear_algebra_library_type, ceres::EIGEN_SPARSE);
  EXPECT_EQ(options.dense_linear_algebra_library_type, ceres::EIGEN);
  const ceres::Solver::Summary summary = SolveQuietly(options, problem);
  EXPECT_TRUE(summary.IsSolutionUsable());
  EXPECT_EQ(summary.sparse_linear_algebra_library_type, ceres::EIGEN_SPARSE);
  EXPECT_NEAR(x.front(), 3.0, 1e-4);
  EXPECT_NEAR(x.back(), 52.0, 1e-4);
}

int TasksOfThisProcess() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<int>(std::distance(begin(tasks), end(tasks)));
}

TEST(EndBlasThreads, LeavesTheCallersAlone) {
  const auto threads = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_num_threads"));
  const auto set_threads =
      reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  if (threads == nullptr || set_threads == nullptr) GTEST_SKIP() << "the BLAS is not OpenBLAS";
  set_threads(2);
  const int tasks = TasksOfThisProcess();
  EndBlasThreads();
  EXPECT_LT(TasksOfThisProcess(), tasks);
  EXPECT_EQ(threads(), 1);
}

}  // namespace
}  // namespace holdfast
