// SPDX-License-Identifier: MIT
// Zero-masked forms throughout: the plain intrinsics of some compilers' headers start from an
// uninitialised register and trip their own warnings.
#if defined(__AVX512F__)
#include <immintrin.h>

#include "solver/kernels/pair_loop.h"
#include "solver/kernels/rank_update_loop.h"
#include "solver/kernels/sum_halves.h"

namespace holdfast::kernels {
namespace {

struct FloatLanes {
  using Real = float;
  using Vector = __m512;
  static constexpr int kWidth = 16;
  static Vector Zero() { return _mm512_setzero_ps(); }
  static Vector Set(float v) { return _mm512_set1_ps(v); }
  static Vector Load(const float* p) { return _mm512_loadu_ps(p); }
  static Vector Sub(Vector a, Vector b) { return _mm512_sub_ps(a, b); }
  static Vector Mul(Vector a, Vector b) { return _mm512_mul_ps(a, b); }
  static Vector MulAdd(Vector a, Vector b, Vector c) { return _mm512_fmadd_ps(a, b, c); }
  static double Sum(Vector v) {
    const __m512d halves = _mm512_castps_pd(v);
    return SumHalves(_mm256_add_ps(_mm256_castpd_ps(_mm512_maskz_extractf64x4_pd(0xf, halves, 0)),
                                   _mm256_castpd_ps(_mm512_maskz_extractf64x4_pd(0xf, halves, 1))));
  }
  // Reciprocal square root to 14 bits and one Newton step: full single precision.
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    d2 = _mm512_maskz_max_ps(0xffff, _mm512_set1_ps(kTinySquaredDistance<float>), d2);
    const Vector y = _mm512_maskz_rsqrt14_ps(0xffff, d2);
    const Vector half_d2_y = _mm512_mul_ps(_mm512_mul_ps(_mm512_set1_ps(0.5f), d2), y);
    inverse = _mm512_mul_ps(y, _mm512_fnmadd_ps(half_d2_y, y, _mm512_set1_ps(1.5f)));
    distance = _mm512_mul_ps(d2, inverse);
  }
};

struct DoubleLanes {
  using Real = double;
  using Vector = __m512d;
  static constexpr int kWidth = 8;
  static Vector Zero() { return _mm512_setzero_pd(); }
  static Vector Set(double v) { return _mm512_set1_pd(v); }
  static Vector Load(const double* p) { return _mm512_loadu_pd(p); }
  static void Store(double* p, Vector v) { _mm512_storeu_pd(p, v); }
  static Vector Add(Vector a, Vector b) { return _mm512_add_pd(a, b); }
  static Vector Sub(Vector a, Vector b) { return _mm512_sub_pd(a, b); }
  static Vector Mul(Vector a, Vector b) { return _mm512_mul_pd(a, b); }
  static Vector MulAdd(Vector a, Vector b, Vector c) { return _mm512_fmadd_pd(a, b, c); }
  static double Sum(Vector v) {
    return SumHalves(_mm256_add_pd(_mm512_maskz_extractf64x4_pd(0xf, v, 0),
                                   _mm512_maskz_extractf64x4_pd(0xf, v, 1)));
  }
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    distance = _mm512_maskz_sqrt_pd(
        0xff, _mm512_maskz_max_pd(0xff, _mm512_set1_pd(kTinySquaredDistance<double>), d2));
    inverse = _mm512_div_pd(_mm512_set1_pd(1.0), distance);
  }
};

}  // namespace

void PairLoopAvx512(const PairArguments<float>& in) { PairLoop<FloatLanes>(in); }
void PairLoopAvx512(const PairArguments<double>& in) { PairLoop<DoubleLanes>(in); }
void RankUpdateAvx512(const RankUpdateArguments& in) { RankUpdateLoop<DoubleLanes>(in); }

}  // namespace holdfast::kernels
#endif
