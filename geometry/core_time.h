// SPDX-License-Identifier: MIT
#pragma once

#include <ctime>

namespace holdfast {

/// Seconds that this thread has had a core.
inline double CoreSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace holdfast
