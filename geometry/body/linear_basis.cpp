// SPDX-License-Identifier: MIT
#include "geometry/body/linear_basis.h"

#include <cstring>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/value_ranges.h"

namespace holdfast {
namespace {

template <typename T>
std::span<const T> As(const std::vector<std::byte>& data) {
  return {reinterpret_cast<const T*>(data.data()), data.size() / sizeof(T)};
}

}  // namespace

LinearBasis::LinearBasis(NpyMember member, std::ptrdiff_t vertices, std::ptrdiff_t columns) {
  member.RequireShape({vertices, 3, columns});
  NpyArray& array = member.array;
  columns_ = array.shape[2];
  is_double_ = array.kind != 'f' || array.item_size >= 8;
  std::vector<std::byte> data;
  const auto copy = [&](const auto& values) {
    data.resize(values.size() * sizeof(values[0]));
    if (!values.empty()) std::memcpy(data.data(), values.data(), data.size());
  };
  if (member.View<float>() || member.View<double>()) {
    data = std::move(array.data);
  } else if (is_double_) {
    copy(member.AsDoubles());
  } else {
    copy(member.AsFloats());
  }
  const auto bad = is_double_ ? FirstBeyond(As<double>(data), kMostMetres)
                              : FirstBeyond(As<float>(data), kMostMetres);
  if (bad) {
    const double value = is_double_ ? As<double>(data)[*bad] : As<float>(data)[*bad];
    throw Error(member.where, fmt::format("holds {} at element {}", value, *bad),
                "The model file is damaged: get it again");
  }
  data_ = std::make_shared<const std::vector<std::byte>>(std::move(data));
}

void LinearBasis::CopyRow(std::size_t row, std::size_t begin, std::size_t count,
                          double* out) const {
  const std::size_t first = row * columns_ + begin;
  if (is_double_) {
    std::memcpy(out, data_->data() + first * sizeof(double), count * sizeof(double));
    return;
  }
  float value;
  for (std::size_t k = 0; k < count; ++k) {
    std::memcpy(&value, data_->data() + (first + k) * sizeof(float), sizeof value);
    out[k] = value;
  }
}

}  // namespace holdfast
