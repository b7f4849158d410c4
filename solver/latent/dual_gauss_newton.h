// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace holdfast {

/// A Gauss-Newton step for few residuals of very many latents, solved among the residuals:
///
///   dz = -W J^T (kappa I + J W J^T)^-1 r
///
/// `J` is given as its transpose (latent_size T x 4), three goal rows first. W has one weight per
/// step, 1 / (|J_t| + 0.05 mean |J|) of the goal rows, of mean 1: plain least norm (W = I) spends
/// everything in the few early steps that move the wrist most, and leaves the linear range there.
inline Eigen::VectorXf DualStep(const Eigen::MatrixXf& J, const Eigen::Vector4d& r, double kappa,
                                Eigen::Index latent_size) {
  const Eigen::Index steps = J.rows() / latent_size;
  Eigen::VectorXd norms(steps);
  for (Eigen::Index t = 0; t < steps; ++t) {
    norms[t] = J.middleRows(t * latent_size, latent_size).leftCols<3>().norm();
  }
  Eigen::VectorXd weights = (norms.array() + 0.05 * norms.mean() + 1e-12).inverse();
  weights /= weights.mean();
  Eigen::MatrixXf WJ = J;
  for (Eigen::Index t = 0; t < steps; ++t) {
    WJ.middleRows(t * latent_size, latent_size) *= static_cast<float>(weights[t]);
  }
  Eigen::Matrix4d gram = (J.transpose() * WJ).cast<double>();
  gram.diagonal().array() += kappa;
  const Eigen::Vector4d dual = gram.ldlt().solve(r);
  return -(WJ * dual.cast<float>());
}

}  // namespace holdfast
