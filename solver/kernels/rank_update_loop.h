// SPDX-License-Identifier: MIT
// H += A^T A, written once over a `Lanes` type, as pair_loop.h: internal linkage, one source file
// per instruction set.
#pragma once

#include "solver/kernels/rank_update_arguments.h"

namespace holdfast::kernels {
namespace {

// Four rows of H by kVectors vectors of columns, in registers over all rows of A.
template <typename Lanes, int kVectors>
inline void Tile(const RankUpdateArguments& in, int i, int j) {
  using V = typename Lanes::Vector;
  V sum[4][kVectors];
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < kVectors; ++b) sum[a][b] = Lanes::Zero();
  }
  for (int k = 0; k < in.num_rows; ++k) {
    const double* row = in.rows + static_cast<long>(k) * in.width;
    V column[kVectors];
    for (int b = 0; b < kVectors; ++b) column[b] = Lanes::Load(row + j + b * Lanes::kWidth);
    for (int a = 0; a < 4; ++a) {
      const V left = Lanes::Set(row[i + a]);
      for (int b = 0; b < kVectors; ++b) sum[a][b] = Lanes::MulAdd(left, column[b], sum[a][b]);
    }
  }
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < kVectors; ++b) {
      double* out = in.product + static_cast<long>(i + a) * in.width + j + b * Lanes::kWidth;
      Lanes::Store(out, Lanes::Add(Lanes::Load(out), sum[a][b]));
    }
  }
}

template <typename Lanes>
inline void RankUpdateLoop(const RankUpdateArguments& in) {
  for (int i = 0; i < in.width; i += 4) {
    // From the vector that holds the diagonal on: the upper triangle and a little more.
    int j = i / Lanes::kWidth * Lanes::kWidth;
    for (; j + 2 * Lanes::kWidth <= in.width; j += 2 * Lanes::kWidth) Tile<Lanes, 2>(in, i, j);
    if (j < in.width) Tile<Lanes, 1>(in, i, j);
  }
}

}  // namespace
}  // namespace holdfast::kernels
