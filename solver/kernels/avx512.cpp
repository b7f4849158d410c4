// SPDX-License-Identifier: MIT
// Zero-masked forms throughout: the plain intrinsics in some compilers' headers start from an
// uninitialized register and trigger warnings.
#if defined(__AVX512F__)
#include <immintrin.h>

#include "solver/kernels/pair_arguments.h"
#include "solver/kernels/pair_loop.h"

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
  // All ten at once: each step adds halves of two vectors and puts them side by side, so that all
  // lanes are used to the end.
  static void SumTen(const Vector (&v)[10], double* out) {
    Vector pair[5], quad[3];
    for (int k = 0; k < 5; ++k) pair[k] = AddHalves<0x44, 0xee>(v[2 * k], v[2 * k + 1]);
    quad[0] = AddHalves<0x88, 0xdd>(pair[0], pair[1]);
    quad[1] = AddHalves<0x88, 0xdd>(pair[2], pair[3]);
    quad[2] = AddHalves<0x88, 0xdd>(pair[4], pair[4]);
    // Each quarter of a vector now holds one sum, in four parts.
    const Vector eight = AddUnpacked(quad[0], quad[1]), two = AddUnpacked(quad[2], quad[2]);
    const Vector all = _mm512_add_ps(_mm512_maskz_shuffle_ps(0xffff, eight, two, 0x44),
                                     _mm512_maskz_shuffle_ps(0xffff, eight, two, 0xee));
    // Quarter q holds sums q, 4 + q and 8 + q % 2.
    const __m512i order = _mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 2, 6, 2, 6, 2, 6);
    const __m512d sorted = _mm512_castps_pd(_mm512_maskz_permutexvar_ps(0xffff, order, all));
    const __m256 low = _mm256_castpd_ps(_mm512_maskz_extractf64x4_pd(0xf, sorted, 0));
    const __m256 high = _mm256_castpd_ps(_mm512_maskz_extractf64x4_pd(0xf, sorted, 1));
    _mm512_storeu_pd(out, _mm512_maskz_cvtps_pd(0xff, low));
    _mm_storeu_pd(out + 8, _mm_cvtps_pd(_mm256_castps256_ps128(high)));
  }
  template <int kLow, int kHigh>
  static Vector AddHalves(Vector a, Vector b) {
    return _mm512_add_ps(_mm512_maskz_shuffle_f32x4(0xffff, a, b, kLow),
                         _mm512_maskz_shuffle_f32x4(0xffff, a, b, kHigh));
  }
  static Vector AddUnpacked(Vector a, Vector b) {
    return _mm512_add_ps(_mm512_maskz_unpacklo_ps(0xffff, a, b),
                         _mm512_maskz_unpackhi_ps(0xffff, a, b));
  }
  // 14-bit reciprocal square root and one Newton step: full single precision.
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    const Vector y = _mm512_maskz_rsqrt14_ps(0xffff, d2);
    const Vector rough = _mm512_mul_ps(d2, y), half = _mm512_set1_ps(0.5f);
    const Vector error = _mm512_fnmadd_ps(rough, _mm512_mul_ps(half, y), half);
    inverse = _mm512_fmadd_ps(y, error, y);
    distance = _mm512_fmadd_ps(rough, error, rough);
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
  static void SumTen(const Vector (&v)[10], double* out) { SumEach<DoubleLanes>(v, out); }
  static void SqrtAndInverse(Vector d2, Vector& distance, Vector& inverse) {
    distance = _mm512_maskz_sqrt_pd(0xff, d2);
    inverse = _mm512_div_pd(_mm512_set1_pd(1.0), distance);
  }
};

}  // namespace

void PairLoopAvx512(const PairArguments<float>& in) { PairLoop<FloatLanes>(in); }
void PairLoopAvx512(const PairArguments<double>& in) { PairLoop<DoubleLanes>(in); }
void RankUpdateAvx512(const double* rows, int num_rows, int width, double* product) {
  RankUpdateLoop<DoubleLanes>(rows, num_rows, width, product);
}

}  // namespace holdfast::kernels
#endif
