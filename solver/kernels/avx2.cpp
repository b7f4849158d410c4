// SPDX-License-Identifier: MIT
#if defined(__AVX2__)
#include <immintrin.h>

#include "solver/kernels/pair_arguments.h"
#include "solver/kernels/pair_loop.h"

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
  // Four at a time: each step adds neighbors of two vectors and stores the sums side by side.
  static void SumTen(const Vector (&v)[10], double* out) {
    StoreFour(_mm256_hadd_ps(_mm256_hadd_ps(v[0], v[1]), _mm256_hadd_ps(v[2], v[3])), out);
    StoreFour(_mm256_hadd_ps(_mm256_hadd_ps(v[4], v[5]), _mm256_hadd_ps(v[6], v[7])), out + 4);
    const Vector two = _mm256_hadd_ps(_mm256_hadd_ps(v[8], v[9]), _mm256_setzero_ps());
    _mm_storeu_pd(out + 8, _mm_cvtps_pd(_mm_add_ps(_mm256_castps256_ps128(two),
                                                   _mm256_extractf128_ps(two, 1))));
  }
  static void StoreFour(Vector halves, double* out) {
    _mm256_storeu_pd(out, _mm256_cvtps_pd(_mm_add_ps(_mm256_castps256_ps128(halves),
                                                     _mm256_extractf128_ps(halves, 1))));
  }
  // 12-bit reciprocal square root and one Newton step: 23 bits at a third of the cost.
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    const Vector y = _mm256_rsqrt_ps(d2);
    const Vector rough = _mm256_mul_ps(d2, y), half = _mm256_set1_ps(0.5f);
    const Vector error = _mm256_fnmadd_ps(rough, _mm256_mul_ps(half, y), half);
    inverse = _mm256_fmadd_ps(y, error, y);
    distance = _mm256_fmadd_ps(rough, error, rough);
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
  static void SumTen(const Vector (&v)[10], double* out) { SumEach<DoubleLanes>(v, out); }
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    distance = _mm256_sqrt_pd(d2);
    inverse = _mm256_div_pd(_mm256_set1_pd(1.0), distance);
  }
};

}  // namespace

void PairLoopAvx2(const PairArguments<float>& in) { PairLoop<FloatLanes>(in); }
void PairLoopAvx2(const PairArguments<double>& in) { PairLoop<DoubleLanes>(in); }
void RankUpdateAvx2(const double* rows, int num_rows, int width, double* product) {
  RankUpdateLoop<DoubleLanes>(rows, num_rows, width, product);
}

}  // namespace holdfast::kernels
#endif
