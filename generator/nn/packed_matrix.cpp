// SPDX-License-Identifier: MIT
#include "generator/nn/packed_matrix.h"

#include <algorithm>
#include <cassert>

namespace holdfast::nn {
namespace {

// Up to this many columns, reading the matrix is the bottleneck and skipping zeros pays off.
constexpr int kFewColumns = 6;

}  // namespace

template <typename Real>
const kernels::LayerLoops<Real>& LoopsFor(Isa isa) {
#if defined(HOLDFAST_X86_KERNELS)
  assert(IsSupported(isa));
  // Only on processors that support them: the functions that fill the table use the same flags.
  if (isa == Isa::kAvx512) {
    static const kernels::LayerLoops<Real> avx512 = kernels::Avx512LayerLoops<Real>();
    return avx512;
  }
  if (isa == Isa::kAvx2) {
    static const kernels::LayerLoops<Real> avx2 = kernels::Avx2LayerLoops<Real>();
    return avx2;
  }
#endif
  static const kernels::LayerLoops<Real> generic = kernels::GenericLayerLoops<Real>();
  static_cast<void>(isa);
  return generic;
}

template <typename Real>
PackedMatrix<Real>::PackedMatrix(const Matrix& a)
    : rows_(static_cast<int>(a.rows())),
      inner_(static_cast<int>(a.cols())),
      data_(static_cast<std::size_t>(PaddedRows(rows_)) * inner_, Real(0)) {
  std::size_t begin = 0;
  for (int row = 0; row < PaddedRows(rows_); row += kernels::kPanelRows) {
    const int panel_rows = std::min(PaddedRows(rows_) - row, kernels::kPanelRows);
    const int filled = std::min(rows_ - row, panel_rows);
    for (int k = 0; k < inner_; ++k) {
      for (int r = 0; r < filled; ++r) {
        data_[begin + static_cast<std::size_t>(k) * panel_rows + r] = a(row + r, k);
      }
    }
    begin += static_cast<std::size_t>(panel_rows) * inner_;
  }
}

template <typename Real>
void PackedMatrix<Real>::Multiply(const kernels::LayerLoops<Real>& loops, const Real* x,
                                  long x_stride, int num_columns, Real* y, long y_stride,
                                  int* visited) const {
  kernels::ProductArguments<Real> in{data_.data(), PaddedRows(rows_), inner_, x, x_stride,
                                     num_columns,  nullptr,           inner_, y, y_stride};
  if (visited && num_columns <= kFewColumns) {
    int count = 0;
    for (int k = 0; k < inner_; ++k) {
      bool any = false;
      for (int c = 0; c < num_columns; ++c) any |= x[k + c * x_stride] != Real(0);
      visited[count] = k;
      count += any;
    }
    in.num_visited = count;
    if (count < inner_) in.visited = visited;
  }
  loops.product(in);
}

template class PackedMatrix<float>;
template class PackedMatrix<double>;
template const kernels::LayerLoops<float>& LoopsFor<float>(Isa);
template const kernels::LayerLoops<double>& LoopsFor<double>(Isa);

}  // namespace holdfast::nn
