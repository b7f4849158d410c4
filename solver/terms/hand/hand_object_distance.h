// SPDX-License-Identifier: MIT
#pragma once

#include <variant>
#include <vector>

#include <Eigen/Core>

#include "solver/kernels/pair_kernel.h"
#include "solver/unknowns/vertex_term.h"

namespace holdfast {

/// Arithmetic of the pair loop. Single precision moves the optimum by about 1e-8 of its energy and
/// runs twice as fast; sums over vertices are double either way.
enum class PairPrecision { kSingle, kDouble };

/// E_d: hand and object keep the distances they had in the first frame (IMoS, Ghosh et al. 2023,
/// eq. 7, read as the squared Frobenius norm).
///
///   E_d = sum_ij ( |v_i(P) - (R o_j + T)| - D_ij )^2
///
/// N x M residuals, metres, of one hand's N vertices and the object's M (300). In the object's
/// frame the residuals of vertex i depend on z_i alone, so that they sum up exactly to a 3 x 3
/// Hessian, a gradient and a cost: one streaming pass over the pairs, nothing approximated. Where a
/// hand and an object vertex coincide the direction is taken as zero. Weight: lambda_d, on the sum.
class HandObjectDistance final : public VertexTerm {
 public:
  /// `object` is (3 x M), in the object's frame; `reference` (M x N) holds D, column i for hand
  /// vertex i.
  HandObjectDistance(const Eigen::Matrix3Xd& object, const Eigen::MatrixXd& reference,
                     double weight, PairPrecision precision = PairPrecision::kSingle,
                     Isa isa = BestIsa());

  double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const override;

  /// D for hand vertices `z` (3 x N) and object vertices (3 x M), both in the object's frame: (M x
  /// N).
  static Eigen::MatrixXd Distances(const Eigen::Matrix3Xd& z, const Eigen::Matrix3Xd& object);

 private:
  template <typename Real>
  struct Pairs {
    PairTargets<Real> targets;
    std::vector<Real> reference;  // N rows of targets.Stride()
    Pairs(const Eigen::Matrix3Xd& object, const Eigen::MatrixXd& distances);
  };
  template <typename Real>
  double AddPairs(const Pairs<Real>& pairs, const Eigen::Matrix3Xd& z,
                  std::span<VertexQuadratic> quadratics) const;

  double weight_;
  Isa isa_;
  std::variant<Pairs<float>, Pairs<double>> pairs_;  // in the precision asked for
};

}  // namespace holdfast
