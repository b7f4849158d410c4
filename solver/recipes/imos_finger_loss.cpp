// SPDX-License-Identifier: MIT
#include "solver/recipes/imos_finger_loss.h"

#include <cmath>

namespace holdfast {

ImosFingerLoss::ImosFingerLoss(HandState& state, const Eigen::Matrix3Xd& object,
                               const FingerPose& start, double lambda_contact, double lambda_drift,
                               double tau_m)
    : state_(state),
      object_(object.transpose()),
      lambda_contact_(lambda_contact),
      lambda_drift_(lambda_drift),
      tau_(tau_m) {
  state_.Evaluate(start, false);
  start_vertices_ = state_.Vertices();
  start_to_near_.resize(3, start_vertices_.cols());
  for (Eigen::Index j = 0; j < start_vertices_.cols(); ++j) {
    const Eigen::Vector3d v = start_vertices_.col(j);
    start_to_near_.col(j) = object_.row(Nearest(v)).transpose() - v;
  }
  weight_ = (-2.0 * start_to_near_.colwise().norm().transpose().array()).exp();
  slopes_.resize(3, start_vertices_.cols());
}

int ImosFingerLoss::Nearest(const Eigen::Vector3d& point) {
  squares_ = (object_.col(0).array() - point.x()).square() +
             (object_.col(1).array() - point.y()).square() +
             (object_.col(2).array() - point.z()).square();
  int index = 0;
  squares_.minCoeff(&index);
  return index;
}

double ImosFingerLoss::Evaluate(const FingerPose& fingers, FingerPose* gradient) {
  state_.Evaluate(fingers, gradient != nullptr);
  const Eigen::Matrix3Xd& vertices = state_.Vertices();
  const Eigen::Index num_vertices = vertices.cols(), num_object = object_.rows();
  const double share = 1.0 / (3.0 * static_cast<double>(num_vertices));
  double vectors = 0.0, drift = 0.0;
  for (Eigen::Index j = 0; j < num_vertices; ++j) {
    const Eigen::Vector3d v = vertices.col(j);
    const Eigen::Vector3d change = object_.row(Nearest(v)).transpose() - v - start_to_near_.col(j);
    const Eigen::Vector3d way = v - start_vertices_.col(j);
    const double square = weight_(j) * weight_(j);
    vectors += square * change.squaredNorm();
    drift += way.squaredNorm();
    slopes_.col(j) = 2.0 * share * (lambda_drift_ * way - square * change);
  }
  double contact = 0.0;
  int touching = 0;
  for (const bool add_slopes : {false, true}) {  // the mean needs the count first
    if (add_slopes && (touching == 0 || gradient == nullptr)) break;
    for (Eigen::Index k = 0; k < num_vertices; ++k) {
      const Eigen::Index entry = k * num_object;
      const Eigen::Index i = entry / num_vertices, j = entry % num_vertices;
      const Eigen::Vector3d away = vertices.col(j) - object_.row(i).transpose();
      const double distance = away.norm();
      if (!(distance < tau_)) continue;
      if (!add_slopes) {
        contact += distance;
        ++touching;
      } else if (distance > 0.0) {
        slopes_.col(j) += lambda_contact_ / touching * away / distance;
      }
    }
  }
  if (touching > 0) contact /= touching;
  if (gradient != nullptr) {
    gradient->setZero();
    for (Eigen::Index j = 0; j < num_vertices; ++j) {
      state_.AddJacobianRow(static_cast<int>(j), slopes_.col(j), gradient->data());
    }
  }
  return share * vectors + lambda_contact_ * contact + lambda_drift_ * share * drift;
}

}  // namespace holdfast
