// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "meshes/make/body/body_mesh.h"

namespace holdfast {

/// Skinning weights (V x 55): smooth, not negative, at most four per vertex, rows summing to 1,
/// mirrored exactly. Along every bone the change from parent to child is a smooth ramp across the
/// joint's bisecting plane, as wide as the limb is thick: narrower and the inside of the bend
/// folds, wider and the bone bends like rubber. Beyond the webs a finger knows nothing of its
/// neighbours.
Eigen::MatrixXd SkinningWeights(const BodyMesh& body);

/// Weights averaged over the neighbourhood a number of times (body only: from the wrists on they
/// stay as they are), mirrored exactly.
Eigen::MatrixXd SmoothedWeights(const BodyMesh& body, const Eigen::MatrixXd& weights, int rounds);

/// Per vertex the weight on a joint and all that hangs on it, or on all the joint hangs on (V).
Eigen::VectorXd SubtreeWeights(const Eigen::MatrixXd& weights, int joint);
Eigen::VectorXd AncestorWeights(const Eigen::MatrixXd& weights, int joint);

}  // namespace holdfast
