// SPDX-License-Identifier: MIT
// The loops that a residual network adds to those of a layer; included by layer_loops.h, and with
// internal linkage as explained there.
#pragma once

#include "generator/nn/kernels/layer_arguments.h"

namespace holdfast::kernels {
namespace {

template <typename Real>
struct ExpConstants;
template <>
struct ExpConstants<float> {
  static constexpr float kLimit = 87.0f;        // exp(+-kLimit) is an ordinary number
  static constexpr float kRounder = 0x1.8p23f;  // adding it rounds to an integer
  static constexpr int kMantissaBits = 23;
  static constexpr float kLn2High = 0.693359375f;  // few bits: its products with n are exact
  static constexpr float kLn2Low = -2.12194440e-4f;
  static constexpr int kDegree = 7;  // of Taylor's series on |r| <= ln(2) / 2
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

/// exp(x) within two units in the last place, x taken into +-kLimit first; NaN stays NaN.
/// x = n ln(2) + r, exp(x) = 2^n exp(r).
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
  // The low bits of `rounded` are n, which belongs into the exponent.
  const Bits power =
      (reinterpret_cast<Bits>(rounded) << C::kMantissaBits) + reinterpret_cast<Bits>(ones);
  return sum * reinterpret_cast<Vector>(power);
}

template <typename S>
void Normalise(const NormaliseArguments<typename S::Real>& in) {
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
void Sum(const SumArguments<typename S::Real>& in) {
  for (int j = 0; j < in.num_columns; ++j) {
    const typename S::Real* x = in.x ? in.x + j * in.x_stride : nullptr;
    typename S::Real* y = in.y + j * in.y_stride;
    for (int i = 0; i < in.padded_rows; i += S::kWidth) {
      typename S::Vector v = S::Load(y + i);
      if (in.bias) v += S::Load(in.bias + i);
      if (x) v += S::Load(x + i);
      S::Store(y + i, v);
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

template <typename S>
void LeakyBackward(const LeakyBackwardArguments<typename S::Real>& in) {
  for (int j = 0; j < in.num_columns; ++j) {
    const typename S::Real* y = in.y + j / in.gradients_per_column * in.y_stride;
    typename S::Real* g = in.gradient + j * in.gradient_stride;
    for (int i = 0; i < in.padded_rows; i += S::kWidth) {
      const typename S::Vector gradient = S::Load(g + i);
      S::Store(g + i, S::Load(y + i) > 0 ? gradient : gradient * in.slope);
    }
  }
}

}  // namespace
}  // namespace holdfast::kernels
