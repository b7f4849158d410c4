// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

namespace holdfast {

/// What a term knows of one hand vertex, in Gauss-Newton form. All residuals r that depend on
/// nothing but z_i, the vertex in the object's frame, are summed:
///   cost = 1/2 sum r^2,  gradient = sum r dr/dz,  hessian = sum (dr/dz)^T (dr/dz).
struct VertexQuadratic {
  Eigen::Matrix3d hessian;
  Eigen::Vector3d gradient;
  double cost;
};

/// A term of the fit's energy that sees the hand only through its vertices in the object's frame,
///   z_i = R^T (v_i(P) - T),  metres.
/// Whatever its number of residuals, it costs the solver 3 + 1 numbers a vertex: HandObjectBlock
/// chains them to (R, T, P). To add such a term, derive from this in a header of its own under
/// solver/terms and hand it to HandObjectBlock.
class VertexTerm {
 public:
  virtual ~VertexTerm() = default;

  /// Adds this term's quadratic at each column of `z` (3 x N) to `quadratics` (N), weight included.
  /// Returns the energy as the paper writes it: without weight and without the solver's factor 1/2.
  virtual double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const = 0;
};

}  // namespace holdfast
