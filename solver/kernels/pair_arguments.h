// SPDX-License-Identifier: MIT
#pragma once

#include <immintrin.h>

namespace holdfast::kernels {

/// Plain pointers: sources compiled for one instruction set include no library header.
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

// Added to squared distances, so that coinciding points give a zero unit vector; lost in rounding
// beyond a micrometer.
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

/// RankUpdate of pair_kernel.h.
void RankUpdateScalar(const double* rows, int num_rows, int width, double* product);
void RankUpdateSse2(const double* rows, int num_rows, int width, double* product);
void RankUpdateAvx2(const double* rows, int num_rows, int width, double* product);
void RankUpdateAvx512(const double* rows, int num_rows, int width, double* product);

// Horizontal sum of an AVX register, by halves. Internal linkage, as in pair_loop.h.
namespace {

[[maybe_unused]] inline double SumHalves(__m256d v) {
  const __m128d two = _mm_add_pd(_mm256_castpd256_pd128(v), _mm256_extractf128_pd(v, 1));
  return _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)));
}

}  // namespace
}  // namespace holdfast::kernels
