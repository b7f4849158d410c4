// SPDX-License-Identifier: MIT
#include "geometry/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include <dlfcn.h>

#ifdef __linux__
#include <sched.h>
#endif

namespace holdfast {

int AvailableThreads() {
  int threads = static_cast<int>(std::thread::hardware_concurrency());
#ifdef __linux__
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof(allowed), &allowed) == 0) threads = CPU_COUNT(&allowed);
  // A container's quota, "QUOTA PERIOD" in microseconds; "max" without one.
  std::ifstream share("/sys/fs/cgroup/cpu.max");
  std::string quota;
  double period = 0.0;
  if (share >> quota >> period && quota != "max" && period > 0.0) {
    const double cores = std::ceil(std::strtod(quota.c_str(), nullptr) / period);
    if (cores >= 1.0) threads = static_cast<int>(std::min<double>(threads, cores));
  }
#endif
  // Cores that Slurm allocated to the job step, even if it does not bind processes to cores.
  if (const char* const given = std::getenv("SLURM_CPUS_PER_TASK"); given != nullptr) {
    if (const int cores = std::atoi(given); cores >= 1) threads = std::min(threads, cores);
  }
  return std::max(1, threads);
}

void EndBlasThreads() {
  // Of the BLAS loaded at run time, whichever the program is linked against.
  const auto set_threads =
      reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  const auto end_threads =
      reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "blas_thread_shutdown_"));
  if (set_threads == nullptr || end_threads == nullptr) return;
  set_threads(1);  // first: otherwise it would create them again
  end_threads();
}

bool IsSupported(Isa isa) {
  switch (isa) {
    case Isa::kScalar:
      return true;
#if defined(__x86_64__) || defined(__i386__)
    case Isa::kSse2:
      return __builtin_cpu_supports("sse2");
    case Isa::kAvx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    case Isa::kAvx512:
      return __builtin_cpu_supports("avx512f");
#endif
    default:
      return false;
  }
}

Isa BestIsa() {
  for (const Isa isa : {Isa::kAvx512, Isa::kAvx2, Isa::kSse2}) {
    if (IsSupported(isa)) return isa;
  }
  return Isa::kScalar;
}

std::string_view IsaName(Isa isa) {
  constexpr std::array<std::string_view, 4> kNames = {"scalar", "sse2", "avx2", "avx512"};
  return kNames[static_cast<std::size_t>(isa)];
}

}  // namespace holdfast
