// SPDX-License-Identifier: MIT
#include "solver/unknowns/sparse_solve.h"

#include <dlfcn.h>

#include <filesystem>
#include <iterator>
#include <optional>

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "geometry/parallel.h"

namespace holdfast {
namespace {

// OpenBLAS's own number of threads, set to 2 while it lives.
struct TwoBlasThreads {
  TwoBlasThreads() {
    if (Known()) before = threads(), set_threads(2);
  }
  ~TwoBlasThreads() {
    if (Known()) set_threads(before);
  }
  bool Known() const { return threads != nullptr && set_threads != nullptr; }

  int (*threads)() = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_num_threads"));
  void (*set_threads)(int) = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT,
                                                                   "openblas_set_num_threads"));
  int before = 1;
};

struct DistanceTo3 {
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    residual[0] = x[0] - 3.0;
    return true;
  }
};

struct SeeThreads : ceres::IterationCallback {
  explicit SeeThreads(const TwoBlasThreads& blas) : blas_(blas) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    seen = blas_.threads();
    return ceres::SOLVER_CONTINUE;
  }
  const TwoBlasThreads& blas_;
  int seen = 0;
};

TEST(SparseSolve, LeavesBlasOneThreadAndGivesBackTheRest) {
  const TwoBlasThreads blas;
  if (!blas.Known()) GTEST_SKIP() << "the BLAS here is not OpenBLAS";
  double x = 0.0;
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DistanceTo3, 1, 1>(new DistanceTo3),
                           nullptr, &x);
  ceres::Solver::Options options = SparseOptions(20, 1e-9);
  SeeThreads see(blas);
  options.callbacks.push_back(&see);
  EXPECT_TRUE(SolveQuietly(options, problem).IsSolutionUsable());
  EXPECT_NEAR(x, 3.0, 1e-3);
  EXPECT_EQ(see.seen, 1);
  EXPECT_EQ(blas.threads(), 2);
}

int TasksOfThisProcess() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<int>(std::distance(begin(tasks), end(tasks)));
}

TEST(EndBlasThreads, LeavesTheCallersAlone) {
  TwoBlasThreads blas;
  if (!blas.Known()) GTEST_SKIP() << "the BLAS here is not OpenBLAS";
  const int tasks = TasksOfThisProcess();
  EndBlasThreads();
  EXPECT_LT(TasksOfThisProcess(), tasks);
  EXPECT_EQ(blas.threads(), 1);
  { const OneBlasThread one; }
  EXPECT_LT(TasksOfThisProcess(), tasks);
}

TEST(OneBlasThread, LastToGoRestoresTheThreads) {
  const TwoBlasThreads blas;
  if (!blas.Known()) GTEST_SKIP() << "the BLAS here is not OpenBLAS";
  std::optional<OneBlasThread> first(std::in_place);
  {
    const OneBlasThread second;
    first.reset();
    EXPECT_EQ(blas.threads(), 1);
  }
  EXPECT_EQ(blas.threads(), 2);
}

}  // namespace
}  // namespace holdfast
