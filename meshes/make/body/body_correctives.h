// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "meshes/make/body/body_mesh.h"

namespace holdfast {

/// Corrective blend shapes, V x 3 x 486 in C order as SMPL-X stores them: offset of vertex i along
/// axis a per entry of R_j - I of joint j at ((3 i + a) 486 + 9 (j - 1) + 3 row + column).
///
/// Between two bones at an angle theta, linear blending maps the part of x - J perpendicular to the
/// axis by (1 - w) + w exp(i theta) in the complex plane: right in direction, too short by
/// |.| = sqrt(1 - 2 w (1 - w) (1 - cos theta)). The offset that restores the length grows with
/// 1 - cos theta to good accuracy, and (1 - cos theta) times the perpendicular part of x - J is
/// (I - (R + R^T) / 2)(x - J): linear in R, the same for every axis, so it is exact in form for
/// hinge and ball joints alike. Only its factor c(w) has to be fitted, over bends up to a right
/// angle.
std::vector<float> PoseCorrectives(const BodyMesh& body, const Eigen::MatrixXd& weights);

}  // namespace holdfast
