// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"

namespace holdfast {

/// The finger loss of IMoS's released code, of one hand with N vertices v_j, against the M vertices
/// of an object held still, all in the world and in metres:
///
///   L = 1/(3N) sum_j |w_j (D_j - D0_j)|^2  +  l_c mean{ d_p : p in S, d_p < tau }
///     + l_d/(3N) sum_j |v_j - v0_j|^2
///   D_j = (object vertex nearest to v_j) - v_j,   w_j = exp(-2 |D0_j|)
///
/// v0, D0 belong to the start fingers; the nearest vertices are found anew at each evaluation, and
/// the gradient takes them as given. S is every M-th entry of the M x N distances, row by row of
/// the object: an arbitrary sample of N pairs. Without a pair below tau the second term is left
/// out.
class ImosFingerLoss {
 public:
  /// `state` has its body set, is written to, and outlives this. `object` (3 x M), world.
  ImosFingerLoss(HandState& state, const Eigen::Matrix3Xd& object, const FingerPose& start,
                 double lambda_contact, double lambda_drift, double tau_m);

  /// L, and with `gradient` dL / d fingers.
  double Evaluate(const FingerPose& fingers, FingerPose* gradient);

 private:
  int Nearest(const Eigen::Vector3d& point);

  HandState& state_;
  Eigen::MatrixX3d object_;  // coordinates apart, for the search
  double lambda_contact_, lambda_drift_, tau_;
  Eigen::Matrix3Xd start_vertices_;  // v0
  Eigen::Matrix3Xd start_to_near_;   // D0
  Eigen::VectorXd weight_;           // w
  Eigen::Matrix3Xd slopes_;          // dL / dv
  Eigen::VectorXd squares_;          // scratch of the search
};

}  // namespace holdfast
