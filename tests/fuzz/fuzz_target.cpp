// SPDX-License-Identifier: MIT
#include "tests/fuzz/fuzz_target.h"

#include <chrono>

#include <fmt/format.h>

#include "geometry/error.h"
#include "tests/fuzz/live_memory.h"

namespace holdfast::fuzz {
namespace {

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

std::vector<FuzzTarget>& Targets() {
  static std::vector<FuzzTarget> targets;
  return targets;
}

Trial::Trial(std::span<const std::byte> bytes)
    : bytes_(bytes), started_s_(Now()), live_at_start_(StartPeak()) {}

void Trial::StopCounting() {
  if (stopped_) return;
  stopped_ = true;
  seconds_ = Now() - started_s_;
  peak_bytes_ = PeakBytesSinceStart() - live_at_start_;
  if (peak_bytes_ > AllowedBytes(bytes_.size())) {
    throw BrokenPromise(
        fmt::format("{} bytes were live while reading {} bytes", peak_bytes_, bytes_.size()));
  }
}

void Trial::Accept() {
  StopCounting();
  accepted_ = true;
}

Outcome Run(const FuzzTarget& target, std::span<const std::byte> bytes) {
  Trial trial(bytes);
  std::string refusal;
  try {
    target.read(trial);
    Require(trial.Accepted(), "the target neither accepted its input nor threw");
  } catch (const Error& error) {
    if (trial.Accepted()) {
      throw BrokenPromise(fmt::format("what was accepted raised later: {}", error.what()));
    }
    refusal = error.what();
    Require(!error.Where().empty() && !error.Problem().empty() && !error.Remedy().empty(),
            "an error does not say where, what and what to do");
  }
  trial.StopCounting();
  return {refusal.empty(), std::move(refusal), trial.Seconds(), trial.PeakBytes()};
}

}  // namespace holdfast::fuzz
