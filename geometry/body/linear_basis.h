// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "geometry/io/container/npz.h"

namespace holdfast {

/// Linear directions of a body model, (V, 3, K), in the precision of their file. A full SMPL-X has
/// hundreds of megabytes of them, so only requested parts are converted to double. Copies share the
/// data.
class LinearBasis {
 public:
  LinearBasis() = default;
  /// Throws Error unless `member` is (vertices, 3, columns) of finite numbers; -1 columns matches
  /// any. Adopts the buffer if it is in C order and half, float or double.
  LinearBasis(NpyMember member, std::ptrdiff_t vertices, std::ptrdiff_t columns);

  std::size_t Columns() const { return columns_; }
  /// Negates one coordinate (0 x, 1 y, 2 z) of every vertex.
  void Negate(std::size_t coordinate);
  /// Copies row 3 v + coordinate, columns [begin, begin + count).
  void CopyRow(std::size_t row, std::size_t begin, std::size_t count, double* out) const;
  /// Whether all of these entries are zero.
  bool IsZero(std::size_t row, std::size_t begin, std::size_t count) const;

 private:
  std::size_t item_size_ = 4;  // 2, 4 or 8 bytes: half, float or double
  std::size_t columns_ = 0;
  std::shared_ptr<const std::vector<std::byte>> data_;
};

}  // namespace holdfast
