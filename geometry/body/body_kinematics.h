// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Returns the end of a limb: of the vertices with more than half their weight on `joint`, the one
/// farthest from the joint, relative to it in the T-pose, meters. Zero if there is no such vertex.
Eigen::Vector3d EndSite(const BodySurface& surface, int joint);

/// d vec(R) / d w (9 x 3, R row-major) for R = exp([w]x) with LeftJacobianSO3(w): column m is
/// vec([Jl e_m]x R).
Eigen::Matrix<double, 9, 3> RotationJacobian(const Eigen::Matrix3d& left_jacobian,
                                             const Eigen::Matrix3d& R);

}  // namespace holdfast
