// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace holdfast {

/// Threads that this process may use: of the cores that its affinity allows (taskset, Slurm), at
/// most its control group's share (containers). At least 1.
int AvailableThreads();

/// Calls body(index) for 0 <= index < count on up to `threads` threads, the caller's among them.
/// Which thread takes which index is open: results must be written by index, and then do not depend
/// on `threads`. The first exception is rethrown here when all have stopped.
template <typename Body>
void ParallelFor(int count, int threads, const Body& body) {
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    try {
      for (int index = next++; index < count; index = next++) body(index);
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (int k = 1; k < std::min(threads, count); ++k) helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace holdfast
