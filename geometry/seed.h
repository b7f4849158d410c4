// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace holdfast {

/// Increment between states of SplitMix64 (Steele, Lea & Flood 2014).
inline constexpr std::uint64_t kSplitMixStep = 0x9e3779b97f4a7c15ull;

/// SplitMix64's finalizer: decorrelates adjacent numbers.
constexpr std::uint64_t SplitMix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

/// Derives the seed of one of many streams of `seed`.
constexpr std::uint64_t MixSeed(std::uint64_t seed, std::uint64_t index) {
  return SplitMix64(seed + kSplitMixStep * (index + 1));
}

}  // namespace holdfast
