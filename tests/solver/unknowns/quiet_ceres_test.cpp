// SPDX-License-Identifier: MIT
#include "solver/unknowns/ceres_solve.h"

#include <cstdlib>

#include <gtest/gtest.h>

#if __has_include(<glog/logging.h>)
#include <glog/logging.h>

namespace holdfast {
namespace {

[[noreturn]] void Warn() {
  QuietCeres();
  LOG(ERROR) << "Line search failed";
  std::_Exit(0);
}

void FailACheck() {
  QuietCeres();
  CHECK(false) << "isfinite(x)";
}

TEST(QuietCeres, SaysNothingOfWhatCeresMeets) {
  EXPECT_EXIT(Warn(), ::testing::ExitedWithCode(0), "^$");
}

TEST(QuietCeres, AFailedCheckIsASentenceAndAnExitCode) {
  EXPECT_EXIT(FailACheck(), ::testing::ExitedWithCode(1),
              "^holdfast: the optimizer encountered invalid numbers");
}

}  // namespace
}  // namespace holdfast
#endif
