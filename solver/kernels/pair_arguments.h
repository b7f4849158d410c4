// SPDX-License-Identifier: MIT
#pragma once

namespace holdfast::kernels {

/// Plain pointers: sources built for one instruction set see no library header.
template <typename Real>
struct PairArguments {
  const Real* x;
  const Real* y;
  const Real* z;
  int num_targets;
  int stride;  ///< elements per row of `reference`; rows are readable up to it
  const Real* points;
  int num_points;
  const Real* reference;
  double* sums;  ///< ten per point, in the order of PairSums
};

// Added to squared distances, so that coinciding points give a unit vector of zero; lost in
// rounding beyond a micrometre.
template <typename Real>
inline constexpr Real kTinySquaredDistance = Real(1e-20);
template <>
inline constexpr double kTinySquaredDistance<double> = 1e-200;

void PairLoopScalar(const PairArguments<float>& in);
void PairLoopScalar(const PairArguments<double>& in);
void PairLoopSse2(const PairArguments<float>& in);
void PairLoopSse2(const PairArguments<double>& in);
void PairLoopAvx2(const PairArguments<float>& in);
void PairLoopAvx2(const PairArguments<double>& in);
void PairLoopAvx512(const PairArguments<float>& in);
void PairLoopAvx512(const PairArguments<double>& in);

}  // namespace holdfast::kernels
