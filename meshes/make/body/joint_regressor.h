// SPDX-License-Identifier: MIT
#pragma once

#include "meshes/make/body/body_mesh.h"

namespace holdfast {

/// Weights over the vertices (55 x V) with which the rest joints follow the surface: non-negative,
/// from the ring of skin around the joint. Rows sum to 1 and give the joints of the skeleton, so
/// any affine change of the ring takes its joint along exactly. Mirrored exactly.
Eigen::MatrixXd JointRegressor(const BodyMesh& body, const Eigen::MatrixXd& weights);

}  // namespace holdfast
