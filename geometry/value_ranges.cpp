// SPDX-License-Identifier: MIT
#include "geometry/value_ranges.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

template <typename T>
std::optional<std::size_t> FindBeyond(std::span<const T> values, double most) {
  constexpr std::size_t kBlock = 4096;
  for (std::size_t begin = 0; begin < values.size(); begin += kBlock) {
    const auto block = values.subspan(begin, std::min(kBlock, values.size() - begin));
    const Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>> x(
        block.data(), static_cast<Eigen::Index>(block.size()));
    if (IsWithin(x.abs().template maxCoeff<Eigen::PropagateNaN>(), most)) continue;
    const auto bad = std::ranges::find_if(block, [&](T value) { return !IsWithin(value, most); });
    return begin + static_cast<std::size_t>(bad - block.begin());
  }
  return std::nullopt;
}

}  // namespace

void RequireWithin(const Eigen::Ref<const Eigen::MatrixXd>& values, double most,
                   std::string_view where, std::string_view field, std::string_view column_is,
                   std::string_view remedy) {
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    for (Eigen::Index r = 0; r < values.rows(); ++r) {
      if (IsWithin(values(r, c), most)) continue;
      throw Error(fmt::format("{}[{}]", where, field),
                  fmt::format("holds {:g} in {} {}", values(r, c), column_is, c), remedy);
    }
  }
}

void RequireFrameRate(double rate, std::string_view where) {
  if (rate >= kLowestFrameRate && rate <= kHighestFrameRate) return;
  throw Error(where, fmt::format("has {:g} frames per second", rate),
              "1 to 10,000 are taken: check the rate (import --source-fps says another)");
}

std::optional<std::size_t> FirstBeyond(std::span<const float> values, double most) {
  return FindBeyond(values, most);
}
std::optional<std::size_t> FirstBeyond(std::span<const double> values, double most) {
  return FindBeyond(values, most);
}

}  // namespace holdfast
