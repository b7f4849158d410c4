// SPDX-License-Identifier: MIT
#pragma once

#include "generator/nn/kernels/layer_arguments.h"

// Loops of a layer, written once with the compiler's vector types. Included by one source file per
// instruction set, each compiled with its own flags. Everything here has internal linkage, so that
// the linker cannot select a function built for a newer processor.

#if defined(__FMA__) || defined(__AVX512F__)
#include <immintrin.h>
#endif

namespace holdfast::kernels {
namespace {

template <typename Real>
struct ExpConstants;
template <>
struct ExpConstants<float> {
  static constexpr float kLimit = 87.0f;        // exp(+-kLimit) is a normal number
  static constexpr float kRounder = 0x1.8p23f;  // adding it rounds to an integer
  static constexpr int kMantissaBits = 23;
  static constexpr float kLn2High = 0.693359375f;  // few bits: products with n are exact
  static constexpr float kLn2Low = -2.12194440e-4f;
  static constexpr int kDegree = 7;  // of the Taylor series on |r| <= ln(2) / 2
};
template <>
struct ExpConstants<double> {
  static constexpr double kLimit = 708.0;
  static constexpr double kRounder = 0x1.8p52;
  static constexpr int kMantissaBits = 52;
  static constexpr double kLn2High = 6.93145751953125e-1;
  static constexpr double kLn2Low = 1.42860682030941723212e-6;
  static constexpr int kDegree = 13;
};

/// exp(x) to within two units in the last place. x is clamped to +-kLimit first; NaN stays NaN.
/// Uses x = n ln(2) + r, exp(x) = 2^n exp(r).
template <typename S>
inline typename S::Vector Exp(typename S::Vector x) {
  using Real = typename S::Real;
  using Vector = typename S::Vector;
  using Bits = decltype(x < x);
  using C = ExpConstants<Real>;
  const Vector ones = Vector{} + Real(1);
  x = x < -C::kLimit ? ones * -C::kLimit : x;
  x = x > C::kLimit ? ones * C::kLimit : x;
  const Vector rounded = x * Real(1.4426950408889634) + C::kRounder;
  const Vector n = rounded - C::kRounder;
  const Vector r = (x - n * C::kLn2High) - n * C::kLn2Low;
  Vector sum = ones;
#pragma GCC unroll 16
  for (int k = C::kDegree; k > 0; --k) sum = ones + sum * r * (Real(1) / static_cast<Real>(k));
  // The low bits of `rounded` hold n, which is added to the exponent.
  const Bits power =
      (reinterpret_cast<Bits>(rounded) << C::kMantissaBits) + reinterpret_cast<Bits>(ones);
  return sum * reinterpret_cast<Vector>(power);
}

template <typename S>
void Normalize(const NormalizeArguments<typename S::Real>& in) {
  for (int j = 0; j < in.num_columns; ++j) {
    const typename S::Real* x = in.x + j * in.x_stride;
    typename S::Real* y = in.y + j * in.y_stride;
    const typename S::Real mean = in.mean[j], scale = in.inverse_deviation[j];
    for (int i = 0; i < in.padded_rows; i += S::kWidth) {
      S::Store(y + i,
               (S::Load(x + i) - mean) * scale * S::Load(in.gain + i) + S::Load(in.offset + i));
    }
  }
}

template <typename S>
void Silu(const SiluArguments<typename S::Real>& in) {
  using Real = typename S::Real;
  for (int j = 0; j < in.num_columns; ++j) {
    const Real* x = in.x + j * in.x_stride;
    Real* y = in.y + j * in.y_stride;
    for (int i = 0; i < in.padded_rows; i += S::kWidth) {
      const typename S::Vector a = S::Load(x + i);
      S::Store(y + i, a / (Real(1) + Exp<S>(-a)));
    }
  }
}

template <typename S>
void SiluBackward(const SiluBackwardArguments<typename S::Real>& in) {
  using Real = typename S::Real;
  using Vector = typename S::Vector;
  for (int j = 0; j < in.num_columns; ++j) {
    const Real* x = in.x + j / in.gradients_per_column * in.x_stride;
    Real* g = in.gradient + j * in.gradient_stride;
    for (int i = 0; i < in.padded_rows; i += S::kWidth) {
      const Vector a = S::Load(x + i);
      const Vector sigmoid = Real(1) / (Real(1) + Exp<S>(-a));
      S::Store(g + i, S::Load(g + i) * sigmoid * (Real(1) + a * (Real(1) - sigmoid)));
    }
  }
}

template <typename S>
void Leaky(const LeakyArguments<typename S::Real>& in) {
  for (int j = 0; j < in.num_columns; ++j) {
    const typename S::Real* x = in.x ? in.x + j * in.x_stride : nullptr;
    typename S::Real* y = in.y + j * in.y_stride;
    for (int i = 0; i < in.padded_rows; i += S::kWidth) {
      typename S::Vector v = S::Load(y + i);
      if (in.bias) v += S::Load(in.bias + i);
      if (x) v += S::Load(x + i);
      S::Store(y + i, v > 0 ? v : v * in.slope);
    }
  }
}

/// Vectors of `kBytes`. Tiles of kTileVectors x kTileColumns sums stay in registers. A single
/// column uses kSingleVectors sums, since more sums hide the latency of the additions.
template <typename R, int kBytes, int kTileVectorsOf, int kTileColumnsOf, int kSingleVectorsOf>
struct VectorShape {
  using Real = R;
  typedef R Vector __attribute__((vector_size(kBytes)));
  typedef R Unaligned __attribute__((vector_size(kBytes), aligned(alignof(R)), may_alias));
  static constexpr int kWidth = kBytes / static_cast<int>(sizeof(R));
  static constexpr int kTileVectors = kTileVectorsOf;
  static constexpr int kTileColumns = kTileColumnsOf;
  static constexpr int kSingleVectors = kSingleVectorsOf;

  static Vector Load(const R* p) { return *reinterpret_cast<const Unaligned*>(p); }
  static void Store(R* p, Vector v) { *reinterpret_cast<Unaligned*>(p) = v; }
  /// a b + c, by the fused instruction of the processor if it has one. Left alone, a compiler fuses
  /// only some of the tiles, and a column would depend on the number of columns next to it.
  static Vector MulAdd(Vector a, R b, Vector c) {
    const Vector factor = b - Vector{};
#if defined(__AVX512F__)
    if constexpr (kBytes == 64 && sizeof(R) == 4) return _mm512_fmadd_ps(a, factor, c);
    if constexpr (kBytes == 64 && sizeof(R) == 8) return _mm512_fmadd_pd(a, factor, c);
#elif defined(__FMA__)
    if constexpr (kBytes == 32 && sizeof(R) == 4) return _mm256_fmadd_ps(a, factor, c);
    if constexpr (kBytes == 32 && sizeof(R) == 8) return _mm256_fmadd_pd(a, factor, c);
#endif
    return a * factor + c;
  }
  static R Sum(Vector v) {
    R sum = 0;
    for (int k = 0; k < kWidth; ++k) sum += v[k];
    return sum;
  }
};

template <typename S, int kVectors, int kColumns, bool kVisited>
inline void Tile(const ProductArguments<typename S::Real>& in, const typename S::Real* panel,
                 int panel_rows, const typename S::Real* x, typename S::Real* y) {
  using Vector = typename S::Vector;
  Vector sum[kVectors][kColumns] = {};
  const int count = kVisited ? in.num_visited : in.num_inner;
  for (int i = 0; i < count; ++i) {
    const long k = kVisited ? in.visited[i] : i;
    const typename S::Real* column = panel + k * panel_rows;
    Vector a[kVectors];
#pragma GCC unroll 16
    for (int v = 0; v < kVectors; ++v) a[v] = S::Load(column + v * S::kWidth);
#pragma GCC unroll 16
    for (int c = 0; c < kColumns; ++c) {
      const typename S::Real factor = x[k + c * in.x_stride];
#pragma GCC unroll 16
      for (int v = 0; v < kVectors; ++v) sum[v][c] = S::MulAdd(a[v], factor, sum[v][c]);
    }
  }
#pragma GCC unroll 16
  for (int c = 0; c < kColumns; ++c) {
#pragma GCC unroll 16
    for (int v = 0; v < kVectors; ++v) S::Store(y + c * in.y_stride + v * S::kWidth, sum[v][c]);
  }
}

// Computes the rows of one panel for kColumns columns, in tiles of kVectors, then of one vector.
template <typename S, int kVectors, int kColumns>
inline void PanelTiles(const ProductArguments<typename S::Real>& in, const typename S::Real* panel,
                       int panel_rows, const typename S::Real* x, typename S::Real* y) {
  int row = 0;
  for (; row + kVectors * S::kWidth <= panel_rows; row += kVectors * S::kWidth) {
    if (in.visited) {
      Tile<S, kVectors, kColumns, true>(in, panel + row, panel_rows, x, y + row);
    } else {
      Tile<S, kVectors, kColumns, false>(in, panel + row, panel_rows, x, y + row);
    }
  }
  for (; row < panel_rows; row += S::kWidth) {
    if (in.visited) {
      Tile<S, 1, kColumns, true>(in, panel + row, panel_rows, x, y + row);
    } else {
      Tile<S, 1, kColumns, false>(in, panel + row, panel_rows, x, y + row);
    }
  }
}

template <typename S, int kColumns>
inline void RestColumns(const ProductArguments<typename S::Real>& in, const typename S::Real* panel,
                        int panel_rows, const typename S::Real* x, typename S::Real* y,
                        int columns) {
  if constexpr (kColumns > 0) {
    if (columns == kColumns) {
      constexpr int kVectors = kColumns == 1 ? S::kSingleVectors : S::kTileVectors;
      PanelTiles<S, kVectors, kColumns>(in, panel, panel_rows, x, y);
    } else {
      RestColumns<S, kColumns - 1>(in, panel, panel_rows, x, y, columns);
    }
  }
}

template <typename S>
void Product(const ProductArguments<typename S::Real>& in) {
  const typename S::Real* panel = in.packed;
  for (int row = 0; row < in.padded_rows; row += kPanelRows) {
    const int rest = in.padded_rows - row;
    const int panel_rows = rest < kPanelRows ? rest : kPanelRows;
    int column = 0;
    for (; column + S::kTileColumns <= in.num_columns; column += S::kTileColumns) {
      PanelTiles<S, S::kTileVectors, S::kTileColumns>(
          in, panel, panel_rows, in.x + column * in.x_stride, in.y + column * in.y_stride + row);
    }
    RestColumns<S, S::kTileColumns - 1>(in, panel, panel_rows, in.x + column * in.x_stride,
                                        in.y + column * in.y_stride + row, in.num_columns - column);
    panel += static_cast<long>(panel_rows) * in.num_inner;
  }
}

template <typename S>
void Moments(const MomentArguments<typename S::Real>& in) {
  using Real = typename S::Real;
  using Vector = typename S::Vector;
  const int whole = in.num_rows / (2 * S::kWidth) * (2 * S::kWidth);
  const Real share = Real(1) / static_cast<Real>(in.num_rows);
  for (int j = 0; j < in.num_columns; ++j) {
    const Real* x = in.x + j * in.x_stride;
    Vector sum[2] = {};
    for (int i = 0; i < whole; i += 2 * S::kWidth) {
      sum[0] += S::Load(x + i);
      sum[1] += S::Load(x + i + S::kWidth);
    }
    Real mean = S::Sum(sum[0] + sum[1]);
    for (int i = whole; i < in.num_rows; ++i) mean += x[i];
    mean *= share;
    Vector squares[2] = {};
    for (int i = 0; i < whole; i += 2 * S::kWidth) {
      const Vector a = S::Load(x + i) - mean, b = S::Load(x + i + S::kWidth) - mean;
      squares[0] += a * a;
      squares[1] += b * b;
    }
    Real variance = S::Sum(squares[0] + squares[1]);
    for (int i = whole; i < in.num_rows; ++i) variance += (x[i] - mean) * (x[i] - mean);
    in.mean[j] = mean;
    in.inverse_deviation[j] =
        Real(1) / static_cast<Real>(__builtin_sqrt(double(variance * share + in.epsilon)));
  }
}

template <typename S>
void Finish(const FinishArguments<typename S::Real>& in) {
  using Vector = typename S::Vector;
  for (int j = 0; j < in.num_columns; ++j) {
    typename S::Real* y = in.y + j * in.y_stride;
    const typename S::Real scale = in.inverse_deviation[j];
    const typename S::Real shift = -in.mean[j] * scale;
    for (int i = 0; i < in.padded_rows; i += S::kWidth) {
      Vector v = S::Load(y + i) * scale + (S::Load(in.row_sums + i) * shift + S::Load(in.bias + i));
      if (in.rectified) v = v < 0 ? Vector{} : v;  // keeps NaN
      S::Store(y + i, v);
    }
  }
}

template <typename S>
void NormBackward(const NormBackwardArguments<typename S::Real>& in) {
  using Real = typename S::Real;
  using Vector = typename S::Vector;
  const int whole = in.num_rows / S::kWidth * S::kWidth;
  const Real share = Real(1) / static_cast<Real>(in.num_rows);
  for (int j = 0; j < in.num_columns; ++j) {
    Real* g = in.gradient + j * in.gradient_stride;
    const int column = j / in.gradients_per_column;
    const Real* x = in.x + column * in.x_stride;
    const Real mean = in.mean[column], inverse = in.inverse_deviation[column];
    Vector sum{}, product{};
    for (int i = 0; i < whole; i += S::kWidth) {
      const Vector gradient = S::Load(g + i);
      sum += gradient;
      product += gradient * (S::Load(x + i) - mean);
    }
    Real average = S::Sum(sum), correlation = S::Sum(product);
    for (int i = whole; i < in.num_rows; ++i) {
      average += g[i];
      correlation += g[i] * (x[i] - mean);
    }
    average *= share;
    correlation *= share * inverse * inverse;
    for (int i = 0; i < whole; i += S::kWidth) {
      const Vector value = S::Load(x + i);
      Vector v = (S::Load(g + i) - average - (value - mean) * correlation) * inverse;
      if (in.rectified) v = value > 0 ? v : Vector{};
      S::Store(g + i, v);
    }
    for (int i = whole; i < in.num_rows; ++i) {
      const Real v = (g[i] - average - (x[i] - mean) * correlation) * inverse;
      g[i] = in.rectified && !(x[i] > 0) ? Real(0) : v;
    }
  }
}

template <typename S>
LayerLoops<typename S::Real> LoopsOf() {
  return {&Product<S>,   &Moments<S>, &Finish<S>,       &NormBackward<S>,
          &Normalize<S>, &Silu<S>,    &SiluBackward<S>, &Leaky<S>};
}

}  // namespace
}  // namespace holdfast::kernels
