// SPDX-License-Identifier: MIT
#include "solver/quiet_ceres.h"

#include <gtest/gtest.h>

#if __has_include(<glog/logging.h>)
#include <glog/logging.h>

namespace holdfast {
namespace {

TEST(QuietCeres, SaysNothingOfWhatCeresMeets) {
  EXPECT_EXIT(
      {
        QuietCeres();
        LOG(ERROR) << "Line search failed";
        std::_Exit(0);
      },
      ::testing::ExitedWithCode(0), "^$");
}

TEST(QuietCeres, AFailedCheckIsASentenceAndAnExitCode) {
  EXPECT_EXIT(
      {
        QuietCeres();
        CHECK(false) << "isfinite(x)";
      },
      ::testing::ExitedWithCode(1),
      "^holdfast: the optimizer met numbers that it cannot work with");
}

}  // namespace
}  // namespace holdfast
#endif
