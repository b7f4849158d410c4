// SPDX-License-Identifier: MIT
#pragma once

namespace holdfast::kernels {

// Rows of activations and packed matrices are padded with zeros to a multiple of this, so that the
// loops process whole vectors at any vector width.
inline constexpr int kRowQuantum = 16;
// Rows of one packed panel. The last panel of a matrix may have fewer.
inline constexpr int kPanelRows = 64;

/// Y = A X, column by column. Every element of Y is one chain of multiply-adds in ascending order
/// of the inner index, so a column does not depend on the columns computed with it.
template <typename Real>
struct ProductArguments {
  const Real* packed;  ///< panels of A, in the layout of PackedMatrix
  int padded_rows;
  int num_inner;  ///< rows of X
  const Real* x;
  long x_stride;
  int num_columns;
  /// Inner indices to visit, ascending; X is zero at all others. Null visits all.
  const int* visited;
  int num_visited;
  Real* y;
  long y_stride;
};

/// Mean and 1 / sqrt(variance + epsilon) of each column of X.
template <typename Real>
struct MomentArguments {
  const Real* x;
  long x_stride;
  int num_rows;
  int num_columns;
  Real epsilon;
  Real* mean;
  Real* inverse_deviation;
};

/// Y_ij <- scale_j Y_ij + shift_j row_sums_i + bias_i, clipped below at 0 if `rectified`.
template <typename Real>
struct FinishArguments {
  Real* y;
  long y_stride;
  int padded_rows;
  int num_columns;
  const Real* inverse_deviation;
  const Real* mean;
  const Real* row_sums;
  const Real* bias;
  bool rectified;
};

/// Backward pass of a layer's normalization. Replaces column j of `gradient`, the gradient of the
/// normalized input xhat = (x - mean) inverse_deviation, by the gradient of x,
///   inverse_deviation (g - avg(g) - xhat avg(xhat g)).
/// If `rectified` (x is the output of a rectifier), it is 0 where x is not positive. Column j
/// belongs to column j / gradients_per_column of x.
template <typename Real>
struct NormBackwardArguments {
  Real* gradient;
  long gradient_stride;
  const Real* x;
  long x_stride;
  int num_rows;
  int num_columns;  ///< of `gradient`
  int gradients_per_column;
  const Real* mean;
  const Real* inverse_deviation;
  bool rectified;
};

/// Y = gain (X - mean) inverse_deviation + offset. Rows with zero gain and offset become zero.
template <typename Real>
struct NormalizeArguments {
  const Real* x;
  long x_stride;
  int padded_rows;
  int num_columns;
  const Real* mean;
  const Real* inverse_deviation;
  const Real* gain;
  const Real* offset;
  Real* y;
  long y_stride;
};

/// Y = silu(X) = X / (1 + exp(-X)).
template <typename Real>
struct SiluArguments {
  const Real* x;
  long x_stride;
  int padded_rows;
  int num_columns;
  Real* y;
  long y_stride;
};

/// Turns the gradient of silu(X) into that of X. Column j belongs to column j /
/// gradients_per_column.
template <typename Real>
struct SiluBackwardArguments {
  Real* gradient;
  long gradient_stride;
  const Real* x;
  long x_stride;
  int padded_rows;
  int num_columns;  ///< of `gradient`
  int gradients_per_column;
};

/// Y = leaky(Y + bias + X), where leaky(v) is v if positive and slope v otherwise; with a slope of
/// 1 it is v itself. X and bias may be null (zero).
template <typename Real>
struct LeakyArguments {
  Real* y;
  long y_stride;
  int padded_rows;
  int num_columns;
  const Real* bias;
  const Real* x;
  long x_stride;
  Real slope;
};

/// Loops compiled for one instruction set.
template <typename Real>
struct LayerLoops {
  void (*product)(const ProductArguments<Real>&);
  void (*moments)(const MomentArguments<Real>&);
  void (*finish)(const FinishArguments<Real>&);
  void (*norm_backward)(const NormBackwardArguments<Real>&);
  void (*normalize)(const NormalizeArguments<Real>&);
  void (*silu)(const SiluArguments<Real>&);
  void (*silu_backward)(const SiluBackwardArguments<Real>&);
  void (*leaky)(const LeakyArguments<Real>&);
};

template <typename Real>
LayerLoops<Real> GenericLayerLoops();
template <typename Real>
LayerLoops<Real> Avx2LayerLoops();
template <typename Real>
LayerLoops<Real> Avx512LayerLoops();

}  // namespace holdfast::kernels
