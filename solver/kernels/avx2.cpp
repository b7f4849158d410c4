// SPDX-License-Identifier: MIT
#if defined(__AVX2__)
#include <immintrin.h>

#include "solver/kernels/pair_loop.h"
#include "solver/kernels/rank_update_loop.h"
#include "solver/kernels/sum_halves.h"

namespace holdfast::kernels {
namespace {

struct FloatLanes {
  using Real = float;
  using Vector = __m256;
  static constexpr int kWidth = 8;
  static Vector Zero() { return _mm256_setzero_ps(); }
  static Vector Set(float v) { return _mm256_set1_ps(v); }
  static Vector Load(const float* p) { return _mm256_loadu_ps(p); }
  static Vector Sub(Vector a, Vector b) { return _mm256_sub_ps(a, b); }
  static Vector Mul(Vector a, Vector b) { return _mm256_mul_ps(a, b); }
  static Vector MulAdd(Vector a, Vector b, Vector c) { return _mm256_fmadd_ps(a, b, c); }
  static double Sum(Vector v) { return SumHalves(v); }
  // Reciprocal square root to 12 bits and one Newton step: 23 bits at a third of the cost.
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    d2 = _mm256_max_ps(_mm256_set1_ps(kTinySquaredDistance<float>), d2);
    const Vector y = _mm256_rsqrt_ps(d2);
    const Vector half_d2_y = _mm256_mul_ps(_mm256_mul_ps(_mm256_set1_ps(0.5f), d2), y);
    inverse = _mm256_mul_ps(y, _mm256_fnmadd_ps(half_d2_y, y, _mm256_set1_ps(1.5f)));
    distance = _mm256_mul_ps(d2, inverse);
  }
};

struct DoubleLanes {
  using Real = double;
  using Vector = __m256d;
  static constexpr int kWidth = 4;
  static Vector Zero() { return _mm256_setzero_pd(); }
  static Vector Set(double v) { return _mm256_set1_pd(v); }
  static Vector Load(const double* p) { return _mm256_loadu_pd(p); }
  static void Store(double* p, Vector v) { _mm256_storeu_pd(p, v); }
  static Vector Add(Vector a, Vector b) { return _mm256_add_pd(a, b); }
  static Vector Sub(Vector a, Vector b) { return _mm256_sub_pd(a, b); }
  static Vector Mul(Vector a, Vector b) { return _mm256_mul_pd(a, b); }
  static Vector MulAdd(Vector a, Vector b, Vector c) { return _mm256_fmadd_pd(a, b, c); }
  static double Sum(Vector v) { return SumHalves(v); }
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    distance = _mm256_sqrt_pd(_mm256_max_pd(_mm256_set1_pd(kTinySquaredDistance<double>), d2));
    inverse = _mm256_div_pd(_mm256_set1_pd(1.0), distance);
  }
};

}  // namespace

void PairLoopAvx2(const PairArguments<float>& in) { PairLoop<FloatLanes>(in); }
void PairLoopAvx2(const PairArguments<double>& in) { PairLoop<DoubleLanes>(in); }
void RankUpdateAvx2(const RankUpdateArguments& in) { RankUpdateLoop<DoubleLanes>(in); }

}  // namespace holdfast::kernels
#endif
