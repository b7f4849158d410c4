// SPDX-License-Identifier: MIT
#pragma once

#include "solver/kernels/pair_arguments.h"

// The pair loop, written once for a `Lanes` type. Included by one source file per instruction set,
// each compiled with its own flags: everything here has internal linkage, so that the linker cannot
// pick a function built for a newer processor for an older one.

namespace holdfast::kernels {
namespace {

// Ten sums over lanes, one by one: for instruction sets without a faster method.
template <typename Lanes>
inline void SumEach(const typename Lanes::Vector (&v)[10], double* out) {
  for (int k = 0; k < 10; ++k) out[k] = Lanes::Sum(v[k]);
}

template <typename Lanes>
struct PairAccumulators {
  using V = typename Lanes::Vector;
  V xx = Lanes::Zero(), xy = Lanes::Zero(), xz = Lanes::Zero();
  V yy = Lanes::Zero(), yz = Lanes::Zero(), zz = Lanes::Zero();
  V gx = Lanes::Zero(), gy = Lanes::Zero(), gz = Lanes::Zero();
  V squares = Lanes::Zero();

  // `mask` is 1 for real targets and 0 for padding.
  template <bool kMasked>
  inline void Add(V dx, V dy, V dz, V reference, V mask, V tiny) {
    const V d2 = Lanes::MulAdd(dx, dx, Lanes::MulAdd(dy, dy, Lanes::MulAdd(dz, dz, tiny)));
    V distance, inverse;
    Lanes::SqrtAndInverse(d2, distance, inverse);
    V r = Lanes::Sub(distance, reference);
    if constexpr (kMasked) {
      inverse = Lanes::Mul(inverse, mask);
      r = Lanes::Mul(r, mask);
    }
    const V nx = Lanes::Mul(dx, inverse), ny = Lanes::Mul(dy, inverse),
            nz = Lanes::Mul(dz, inverse);
    xx = Lanes::MulAdd(nx, nx, xx);
    xy = Lanes::MulAdd(nx, ny, xy);
    xz = Lanes::MulAdd(nx, nz, xz);
    yy = Lanes::MulAdd(ny, ny, yy);
    yz = Lanes::MulAdd(ny, nz, yz);
    zz = Lanes::MulAdd(nz, nz, zz);
    gx = Lanes::MulAdd(r, nx, gx);
    gy = Lanes::MulAdd(r, ny, gy);
    gz = Lanes::MulAdd(r, nz, gz);
    squares = Lanes::MulAdd(r, r, squares);
  }
};

template <typename Lanes>
inline void PairLoop(const PairArguments<typename Lanes::Real>& in) {
  using Real = typename Lanes::Real;
  constexpr int kWidth = Lanes::kWidth;
  const int whole = in.num_targets / kWidth * kWidth;
  Real tail_mask[kWidth];
  for (int k = 0; k < kWidth; ++k) tail_mask[k] = whole + k < in.num_targets ? Real(1) : Real(0);
  const auto mask = Lanes::Load(tail_mask);
  const auto tiny = Lanes::Set(kTinySquaredDistance<Real>);
  for (int i = 0; i < in.num_points; ++i) {
    const auto px = Lanes::Set(in.points[3 * i]);
    const auto py = Lanes::Set(in.points[3 * i + 1]);
    const auto pz = Lanes::Set(in.points[3 * i + 2]);
    const Real* reference = in.reference + static_cast<long>(i) * in.stride;
    PairAccumulators<Lanes> sum;
    for (int j = 0; j < whole; j += kWidth) {
      sum.template Add<false>(
          Lanes::Sub(px, Lanes::Load(in.x + j)), Lanes::Sub(py, Lanes::Load(in.y + j)),
          Lanes::Sub(pz, Lanes::Load(in.z + j)), Lanes::Load(reference + j), mask, tiny);
    }
    if (whole < in.num_targets) {
      sum.template Add<true>(
          Lanes::Sub(px, Lanes::Load(in.x + whole)), Lanes::Sub(py, Lanes::Load(in.y + whole)),
          Lanes::Sub(pz, Lanes::Load(in.z + whole)), Lanes::Load(reference + whole), mask, tiny);
    }
    const typename Lanes::Vector sums[10] = {sum.xx, sum.xy, sum.xz, sum.yy, sum.yz,
                                             sum.zz, sum.gx, sum.gy, sum.gz, sum.squares};
    Lanes::SumTen(sums, in.sums + 10L * i);
  }
}

// H += A^T A: four rows of H by kVectors vectors of columns, kept in registers over all rows of A.
template <typename Lanes, int kVectors>
inline void Tile(const double* rows, int num_rows, int width, double* product, int i, int j) {
  using V = typename Lanes::Vector;
  V sum[4][kVectors];
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < kVectors; ++b) sum[a][b] = Lanes::Zero();
  }
  for (int k = 0; k < num_rows; ++k) {
    const double* row = rows + static_cast<long>(k) * width;
    V column[kVectors];
    for (int b = 0; b < kVectors; ++b) column[b] = Lanes::Load(row + j + b * Lanes::kWidth);
    for (int a = 0; a < 4; ++a) {
      const V left = Lanes::Set(row[i + a]);
      for (int b = 0; b < kVectors; ++b) sum[a][b] = Lanes::MulAdd(left, column[b], sum[a][b]);
    }
  }
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < kVectors; ++b) {
      double* out = product + static_cast<long>(i + a) * width + j + b * Lanes::kWidth;
      Lanes::Store(out, Lanes::Add(Lanes::Load(out), sum[a][b]));
    }
  }
}

template <typename Lanes>
inline void RankUpdateLoop(const double* rows, int num_rows, int width, double* product) {
  for (int i = 0; i < width; i += 4) {
    // Starts at the vector that contains the diagonal: the upper triangle and slightly more.
    int j = i / Lanes::kWidth * Lanes::kWidth;
    for (; j + 2 * Lanes::kWidth <= width; j += 2 * Lanes::kWidth) {
      Tile<Lanes, 2>(rows, num_rows, width, product, i, j);
    }
    if (j < width) Tile<Lanes, 1>(rows, num_rows, width, product, i, j);
  }
}

}  // namespace
}  // namespace holdfast::kernels
