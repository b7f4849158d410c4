// SPDX-License-Identifier: MIT
// Horizontal sums of AVX registers, by halves. Internal linkage, as in pair_loop.h.
#pragma once

#include <immintrin.h>

namespace holdfast::kernels {
namespace {

[[maybe_unused]] inline double SumHalves(__m256 v) {
  const __m128 four = _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
  const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
  return double(_mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1))));
}

[[maybe_unused]] inline double SumHalves(__m256d v) {
  const __m128d two = _mm_add_pd(_mm256_castpd256_pd128(v), _mm256_extractf128_pd(v, 1));
  return _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)));
}

}  // namespace
}  // namespace holdfast::kernels
