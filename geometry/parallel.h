// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <ctime>
#include <exception>
#include <functional>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace holdfast {

/// Thrown by ParallelFor once a StopOn's flag is true.
struct WorkStopped : std::exception {
  const char* what() const noexcept override { return "stopped"; }
};

/// During its lifetime, ParallelFor checks `flag` (may be null) before each index and throws
/// WorkStopped once it is true, on this thread and on the threads that ParallelFor starts from it.
/// For work without a progress callback, or without one in its longest part.
class StopOn {
 public:
  explicit StopOn(const std::atomic<bool>* flag) : before_(std::exchange(flag_, flag)) {}
  ~StopOn() { flag_ = before_; }
  StopOn(const StopOn&) = delete;
  StopOn& operator=(const StopOn&) = delete;

  static const std::atomic<bool>* Flag() { return flag_; }

 private:
  inline static thread_local const std::atomic<bool>* flag_ = nullptr;
  const std::atomic<bool>* before_;
};

/// Number of threads that this process may use: the cores in its affinity mask (taskset, Slurm),
/// limited by its control group's quota (containers) and SLURM_CPUS_PER_TASK. At least 1.
int AvailableThreads();

/// Ends OpenBLAS's threads; from then on it only uses the calling thread. The threads are created
/// when the program is loaded and busy-wait for a while, a fifth of the processor time of a
/// half-second command. For a program's main function and for training, whose matrix products are
/// small. No effect for another BLAS (Debian: libopenblas0-pthread). No other code uses a BLAS.
void EndBlasThreads();

/// Calls body(index) for 0 <= index < count on up to `threads` threads, including the caller's. The
/// thread of an index is unspecified: results must be written by index, and then do not depend on
/// `threads`. The first exception is rethrown here when all threads have stopped; see also StopOn.
template <typename Body>
void ParallelFor(int count, int threads, const Body& body) {
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const std::atomic<bool>* const stop = StopOn::Flag();
  const auto work = [&] {
    const StopOn inherited(stop);
    try {
      for (int index = next++; index < count; index = next++) {
        if (stop != nullptr && *stop) throw WorkStopped();
        body(index);
      }
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

/// CPU time of this thread in seconds.
inline double CoreSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Progress callback, never called concurrently, with the stage of the work ("grasp", "fit",
/// "metrics") and its progress. Returning false stops the work.
using StagedProgress = std::function<bool(const char* stage, int done, int total)>;

/// Instruction sets that the hot loops are compiled for; the best one is selected at run time.
enum class Isa { kScalar, kSse2, kAvx2, kAvx512 };

Isa BestIsa();
bool IsSupported(Isa isa);
std::string_view IsaName(Isa isa);

}  // namespace holdfast
