// SPDX-License-Identifier: MIT
#if defined(__SSE2__)
#include <emmintrin.h>

#include "solver/kernels/pair_loop.h"

namespace holdfast::kernels {
namespace {

struct FloatLanes {
  using Real = float;
  using Vector = __m128;
  static constexpr int kWidth = 4;
  static Vector Zero() { return _mm_setzero_ps(); }
  static Vector Set(float v) { return _mm_set1_ps(v); }
  static Vector Load(const float* p) { return _mm_loadu_ps(p); }
  static Vector Sub(Vector a, Vector b) { return _mm_sub_ps(a, b); }
  static Vector Mul(Vector a, Vector b) { return _mm_mul_ps(a, b); }
  static Vector MulAdd(Vector a, Vector b, Vector c) { return _mm_add_ps(_mm_mul_ps(a, b), c); }
  static double Sum(Vector v) {
    float lane[kWidth];
    _mm_storeu_ps(lane, v);
    return double(lane[0]) + double(lane[1]) + double(lane[2]) + double(lane[3]);
  }
  static void SumTen(const Vector (&v)[10], double* out) { SumEach<FloatLanes>(v, out); }
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    distance = _mm_sqrt_ps(d2);
    inverse = _mm_div_ps(_mm_set1_ps(1.0f), distance);
  }
};

struct DoubleLanes {
  using Real = double;
  using Vector = __m128d;
  static constexpr int kWidth = 2;
  static Vector Zero() { return _mm_setzero_pd(); }
  static Vector Set(double v) { return _mm_set1_pd(v); }
  static Vector Load(const double* p) { return _mm_loadu_pd(p); }
  static void Store(double* p, Vector v) { _mm_storeu_pd(p, v); }
  static Vector Add(Vector a, Vector b) { return _mm_add_pd(a, b); }
  static Vector Sub(Vector a, Vector b) { return _mm_sub_pd(a, b); }
  static Vector Mul(Vector a, Vector b) { return _mm_mul_pd(a, b); }
  static Vector MulAdd(Vector a, Vector b, Vector c) { return _mm_add_pd(_mm_mul_pd(a, b), c); }
  static double Sum(Vector v) {
    double lane[kWidth];
    _mm_storeu_pd(lane, v);
    return lane[0] + lane[1];
  }
  static void SumTen(const Vector (&v)[10], double* out) { SumEach<DoubleLanes>(v, out); }
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    distance = _mm_sqrt_pd(d2);
    inverse = _mm_div_pd(_mm_set1_pd(1.0), distance);
  }
};

}  // namespace

void PairLoopSse2(const PairArguments<float>& in) { PairLoop<FloatLanes>(in); }
void PairLoopSse2(const PairArguments<double>& in) { PairLoop<DoubleLanes>(in); }
void RankUpdateSse2(const double* rows, int num_rows, int width, double* product) {
  RankUpdateLoop<DoubleLanes>(rows, num_rows, width, product);
}

}  // namespace holdfast::kernels
#endif
