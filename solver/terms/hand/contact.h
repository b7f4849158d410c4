// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solver/unknowns/vertex_term.h"

namespace holdfast {

/// E_c: what touched in the first frame stays together (IMoS, Ghosh et al. 2023, eq. 8).
///
///   E_c = sum_ij S_ij |v_i(P) - (R o_j + T)|^2,   S_ij = 1 where D_ij < tau, else 0
///
/// Residuals z_i - o_j, metres, in the object's frame, three a contact pair. In closed form, with
/// n_i pairs at vertex i and m_i the mean of their o_j: sum_j |z - o_j|^2 = n_i |z - m_i|^2 +
/// const, so there is neither a pair loop nor the singularity that scalar distances have at zero.
/// Weight: lambda_c, on the sum.
class Contact final : public VertexTerm {
 public:
  /// `object` (3 x M) in the object's frame; `reference` (M x N) first-frame distances; tau metres.
  Contact(const Eigen::Matrix3Xd& object, const Eigen::MatrixXd& reference, double tau_m,
          double weight)
      : weight_(weight) {
    for (Eigen::Index i = 0; i < reference.cols(); ++i) {
      Anchor anchor{i, 0, Eigen::Vector3d::Zero(), 0.0};
      for (Eigen::Index j = 0; j < reference.rows(); ++j) {
        if (reference(j, i) < tau_m) {
          ++anchor.pairs;
          anchor.mean += object.col(j);
        }
      }
      if (anchor.pairs == 0) continue;
      anchor.mean /= anchor.pairs;
      for (Eigen::Index j = 0; j < reference.rows(); ++j) {
        if (reference(j, i) < tau_m) anchor.spread += (object.col(j) - anchor.mean).squaredNorm();
      }
      anchors_.push_back(anchor);
      num_pairs_ += anchor.pairs;
    }
  }

  double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const override {
    double energy = 0.0;
    for (const Anchor& anchor : anchors_) {
      const Eigen::Vector3d difference = z.col(anchor.vertex) - anchor.mean;
      const double squares = anchor.pairs * difference.squaredNorm() + anchor.spread;
      VertexQuadratic& quadratic = quadratics[static_cast<std::size_t>(anchor.vertex)];
      quadratic.hessian.diagonal().array() += weight_ * anchor.pairs;
      quadratic.gradient += weight_ * anchor.pairs * difference;
      quadratic.cost += 0.5 * weight_ * squares;
      energy += squares;
    }
    return energy;
  }

  int NumPairs() const { return num_pairs_; }                  ///< sum of S
  std::size_t NumVertices() const { return anchors_.size(); }  ///< hand vertices with a pair

 private:
  struct Anchor {
    Eigen::Index vertex;
    int pairs;             // n_i
    Eigen::Vector3d mean;  // m_i
    double spread;         // sum_j |o_j - m_i|^2
  };

  double weight_;
  int num_pairs_ = 0;
  std::vector<Anchor> anchors_;
};

}  // namespace holdfast
