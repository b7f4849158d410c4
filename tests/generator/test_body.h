// SPDX-License-Identifier: MIT
#pragma once

#include "generator/scripted/reach_motion.h"
#include "geometry/body/body_model.h"

namespace holdfast {

/// The embedded body's measures, loaded once.
inline const BodyMeasures& DefaultMeasures() {
  static const BodyMeasures body = MeasureBody(*BodyModel::Default(), Eigen::VectorXd());
  return body;
}

/// The same person, resting somewhere else.
inline BodyMeasures MeasuresAt(const Eigen::Vector3d& shift) {
  BodyMeasures body = DefaultMeasures();
  body.rest_joints.colwise() += shift;
  body.sole_y += shift.y();
  return body;
}

}  // namespace holdfast
