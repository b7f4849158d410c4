// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/parallel.h"

namespace holdfast {

/// Sums over the M residuals r_j = |z - o_j| - D_j of one point z, for any Gauss-Newton solver:
/// with n_j = (z - o_j) / |z - o_j| (0 where they coincide),
///   hessian = sum_j n_j n_j^T (xx, xy, xz, yy, yz, zz),  gradient = sum_j r_j n_j,
///   squares = sum_j r_j^2.
struct PairSums {
  double hessian[6];
  double gradient[3];
  double squares;
};

/// Fixed points o_j in the kernel's layout: separate coordinates, padded to whole vectors.
template <typename Real>
class PairTargets {
 public:
  /// `points` is (3 x M), meters.
  explicit PairTargets(const Eigen::Matrix3Xd& points);

  int Count() const { return count_; }
  int Stride() const { return stride_; }  ///< length of a row of D, a multiple of kPad
  const Real* X() const { return coordinates_.data(); }
  const Real* Y() const { return coordinates_.data() + stride_; }
  const Real* Z() const { return coordinates_.data() + 2 * stride_; }

  static constexpr int kPad = 64 / static_cast<int>(sizeof(Real));

 private:
  int count_;
  int stride_;
  std::vector<Real> coordinates_;
};

/// Computes the sums for `num_points` points (x, y, z interleaved). `reference` has a row of
/// Stride() distances for each. Coordinate differences, distances and sums are computed in Real.
template <typename Real>
void SumPairs(Isa isa, const PairTargets<Real>& targets, const Real* points, int num_points,
              const Real* reference, PairSums* sums);

extern template class PairTargets<float>;
extern template class PairTargets<double>;
extern template void SumPairs<float>(Isa, const PairTargets<float>&, const float*, int,
                                     const float*, PairSums*);
extern template void SumPairs<double>(Isa, const PairTargets<double>&, const double*, int,
                                      const double*, PairSums*);

/// product += A^T A for A (num_rows x width, row-major), in its upper triangle (the rest is
/// undefined). `width` is a multiple of 8: pad with zero columns. Sums run over rows in order, so
/// that the result depends on the instruction set only through fused rounding.
void RankUpdate(Isa isa, const double* rows, int num_rows, int width, double* product);

}  // namespace holdfast
