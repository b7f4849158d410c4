// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <new>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/kernels/layer_arguments.h"
#include "geometry/parallel.h"

namespace holdfast::nn {

/// Allocates on cache lines, so that no 64-byte vector straddles two of them.
template <typename T>
struct CacheLineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kAlignment{64};

  CacheLineAllocator() = default;
  template <typename U>
  CacheLineAllocator(const CacheLineAllocator<U>&) {}  // NOLINT: containers convert

  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kAlignment));
  }
  void deallocate(T* memory, std::size_t) { ::operator delete(memory, kAlignment); }
  bool operator==(const CacheLineAllocator&) const { return true; }
};

template <typename T>
using AlignedArray = std::vector<T, CacheLineAllocator<T>>;

/// Stride of the columns of activations: `rows` rounded up to a multiple of kernels::kRowQuantum.
inline constexpr int PaddedRows(int rows) {
  return (rows + kernels::kRowQuantum - 1) / kernels::kRowQuantum * kernels::kRowQuantum;
}

/// Returns the loops for an instruction set, or for the next lower one that has loops.
template <typename Real>
const kernels::LayerLoops<Real>& LoopsFor(Isa isa);

/// A constant matrix A in the layout of the products: panels of 64 rows, column by column within a
/// panel. The last panel is padded with zeros.
template <typename Real>
class PackedMatrix {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  PackedMatrix() = default;
  explicit PackedMatrix(const Matrix& a);

  int Rows() const { return rows_; }
  int Inner() const { return inner_; }

  /// Computes Y = A X for `num_columns` columns. Rows of Y are written up to PaddedRows(Rows()).
  /// Column j of Y depends only on column j of X, bit for bit. With few columns, inner indices at
  /// which all columns are zero are skipped. `visited` is a buffer of Inner() entries for this, or
  /// null if X is not expected to have zeros.
  void Multiply(const kernels::LayerLoops<Real>& loops, const Real* x, long x_stride,
                int num_columns, Real* y, long y_stride, int* visited) const;

 private:
  int rows_ = 0;
  int inner_ = 0;
  AlignedArray<Real> data_;
};

extern template class PackedMatrix<float>;
extern template class PackedMatrix<double>;
extern template const kernels::LayerLoops<float>& LoopsFor<float>(Isa);
extern template const kernels::LayerLoops<double>& LoopsFor<double>(Isa);

}  // namespace holdfast::nn
