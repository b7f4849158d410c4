// SPDX-License-Identifier: MIT
#include "geometry/parallel.h"

#include <atomic>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

TEST(ParallelFor, StopsWhereAFlagSaysSo) {
  for (const int threads : {1, 4}) {
    std::atomic<bool> stop{false};
    std::atomic<int> calls{0};
    const StopOn told(&stop);
    const auto count = [&](int) {
      // The flag is seen by loops within loops, on whichever thread they are.
      ParallelFor(10, 2, [&](int) {
        if (++calls == 20) stop = true;
      });
    };
    EXPECT_THROW(ParallelFor(1000, threads, count), WorkStopped);
    EXPECT_LT(calls, 20 + 2 * threads + 1);
  }
}

TEST(ParallelFor, KnowsNoFlagOnceItsOwnerIsGone) {
  std::atomic<bool> stop{true};
  {
    const StopOn told(&stop);
    const StopOn not_told(nullptr);
    EXPECT_NO_THROW(ParallelFor(4, 2, [](int) {}));
  }
  std::atomic<int> calls{0};
  ParallelFor(4, 2, [&](int) { ++calls; });
  EXPECT_EQ(calls, 4);
}

}  // namespace
}  // namespace holdfast
