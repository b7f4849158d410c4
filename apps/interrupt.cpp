// SPDX-License-Identifier: MIT
#include "apps/interrupt.h"

#include <atomic>
#include <csignal>

#include "apps/common.h"

namespace holdfast::apps {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void OnInterrupt(int signal) {
  interrupted = true;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void WatchForInterrupt() { std::signal(SIGINT, OnInterrupt); }

bool Interrupted() { return interrupted; }

}  // namespace holdfast::apps
