// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cerrno>
#include <cstddef>

/// Counts this program's allocations by standing in for glibc's allocator, which it calls. Include
/// in one source of a program only; others of it that ask for the count define
/// HOLDFAST_ALLOCATIONS_ARE_COUNTED_ELSEWHERE before they include this. With a sanitizer, which
/// stands there itself, nothing is counted.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define HOLDFAST_COUNTS_ALLOCATIONS 1
#endif

namespace holdfast::testing {

inline std::atomic<long> allocation_count{0};

/// Calls of malloc and its kin (operator new among them) so far, by any thread.
inline long AllocationCount() { return allocation_count.load(); }

}  // namespace holdfast::testing

#if defined(HOLDFAST_COUNTS_ALLOCATIONS) && !defined(HOLDFAST_ALLOCATIONS_ARE_COUNTED_ELSEWHERE)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) noexcept {
  ++holdfast::testing::allocation_count;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  ++holdfast::testing::allocation_count;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  ++holdfast::testing::allocation_count;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++holdfast::testing::allocation_count;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  ++holdfast::testing::allocation_count;
  *memory = __libc_memalign(alignment, size);
  return *memory ? 0 : ENOMEM;
}
}
#endif
