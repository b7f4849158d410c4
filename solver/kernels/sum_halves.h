// SPDX-License-Identifier: MIT
// Horizontal sum of an AVX register, by halves. Internal linkage, as in pair_loop.h.
#pragma once

#include <immintrin.h>

namespace holdfast::kernels {
namespace {

[[maybe_unused]] inline double SumHalves(__m256d v) {
  const __m128d two = _mm_add_pd(_mm256_castpd256_pd128(v), _mm256_extractf128_pd(v, 1));
  return _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)));
}

}  // namespace
}  // namespace holdfast::kernels
