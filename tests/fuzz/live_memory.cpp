// SPDX-License-Identifier: MIT
#include "tests/fuzz/live_memory.h"

#include <atomic>
#include <cerrno>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HOLDFAST_HAS_SANITIZER_HOOKS 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HOLDFAST_HAS_SANITIZER_HOOKS 1
#endif
#endif

namespace holdfast::fuzz {
namespace {

std::atomic<std::size_t> live{0};
std::atomic<std::size_t> peak{0};

void Count(std::size_t bytes) {
  const std::size_t now = live.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  std::size_t seen = peak.load(std::memory_order_relaxed);
  while (now > seen && !peak.compare_exchange_weak(seen, now, std::memory_order_relaxed)) continue;
}

void Uncount(std::size_t bytes) { live.fetch_sub(bytes, std::memory_order_relaxed); }

}  // namespace

std::size_t StartPeak() {
  const std::size_t now = live.load();
  peak = now;
  return now;
}

std::size_t PeakBytesSinceStart() { return peak.load(); }

}  // namespace holdfast::fuzz

#ifdef HOLDFAST_HAS_SANITIZER_HOOKS

extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*malloc_hook)(const volatile void*,
                                                                             std::size_t),
                                                         void (*free_hook)(const volatile void*));
extern "C" std::size_t __sanitizer_get_allocated_size(const volatile void* address);

namespace {

const int installed = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void* address, std::size_t) {
      holdfast::fuzz::Count(__sanitizer_get_allocated_size(address));
    },
    [](const volatile void* address) {
      // Null, and what was allocated before these hooks: both report nothing or were never counted.
      if (address != nullptr) holdfast::fuzz::Uncount(__sanitizer_get_allocated_size(address));
    });

}  // namespace

#else

#include <malloc.h>

// glibc's own names for what is put in place of its functions.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
}

namespace {

void* Counted(void* address) {
  if (address != nullptr) holdfast::fuzz::Count(malloc_usable_size(address));
  return address;
}

}  // namespace

extern "C" {

void* malloc(std::size_t bytes) noexcept { return Counted(__libc_malloc(bytes)); }

void* calloc(std::size_t count, std::size_t bytes) noexcept {
  return Counted(__libc_calloc(count, bytes));
}

void* realloc(void* address, std::size_t bytes) noexcept {
  const std::size_t before = address == nullptr ? 0 : malloc_usable_size(address);
  void* moved = __libc_realloc(address, bytes);
  if (moved == nullptr && bytes > 0) return nullptr;
  holdfast::fuzz::Uncount(before);
  return Counted(moved);
}

void* memalign(std::size_t alignment, std::size_t bytes) noexcept {
  return Counted(__libc_memalign(alignment, bytes));
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  return memalign(alignment, bytes);
}

int posix_memalign(void** out, std::size_t alignment, std::size_t bytes) noexcept {
  void* address = memalign(alignment, bytes);
  if (address == nullptr) return ENOMEM;
  *out = address;
  return 0;
}

void free(void* address) noexcept {
  if (address != nullptr) holdfast::fuzz::Uncount(malloc_usable_size(address));
  __libc_free(address);
}

}  // extern "C"

#endif
