// SPDX-License-Identifier: MIT
#include "geometry/parallel.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#ifdef __linux__
#include <sched.h>
#endif

namespace holdfast {

int AvailableThreads() {
  int threads = static_cast<int>(std::thread::hardware_concurrency());
#ifdef __linux__
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof(allowed), &allowed) == 0) threads = CPU_COUNT(&allowed);
  // A container's share, "QUOTA PERIOD" in microseconds; "max" without one.
  std::ifstream share("/sys/fs/cgroup/cpu.max");
  std::string quota;
  double period = 0.0;
  if (share >> quota >> period && quota != "max" && period > 0.0) {
    const double cores = std::ceil(std::strtod(quota.c_str(), nullptr) / period);
    if (cores >= 1.0) threads = static_cast<int>(std::min<double>(threads, cores));
  }
#endif
  return std::max(1, threads);
}

}  // namespace holdfast
