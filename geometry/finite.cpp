// SPDX-License-Identifier: MIT
#include "geometry/finite.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace holdfast {
namespace {

constexpr std::size_t kBlock = 4096;

template <typename T>
std::optional<std::size_t> Find(std::span<const T> values) {
  for (std::size_t begin = 0; begin < values.size(); begin += kBlock) {
    const auto block = values.subspan(begin, std::min(kBlock, values.size() - begin));
    // 0 x is 0 for every finite x, and no number for all others; Eigen sums it in packets.
    const Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>> x(
        block.data(), static_cast<Eigen::Index>(block.size()));
    if ((x * T{0}).sum() == T{0}) continue;
    const auto bad = std::ranges::find_if(block, [](T value) { return !std::isfinite(value); });
    if (bad != block.end()) return begin + static_cast<std::size_t>(bad - block.begin());
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::size_t> FirstNonFinite(std::span<const float> values) { return Find(values); }
std::optional<std::size_t> FirstNonFinite(std::span<const double> values) { return Find(values); }

}  // namespace holdfast
