// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace holdfast {

/// Rest pelvises J_0 of the neutral models' mean shapes, metres (J_regressor v_template), as they
/// stand in public code: SMPL-X in the retargeting tables of kimodo (SMPLX_REST_WORLD), SMPL, whose
/// body SMPL-H shares, in the smpl_humanoid.xml of its simulations. Those of men and women are
/// within a few centimetres.
inline const Eigen::Vector3d kSmplxRestPelvis(0.0031, -0.3514, 0.0120);
inline const Eigen::Vector3d kSmplhRestPelvis(-0.0018, -0.2233, 0.0282);

/// The embedded body's, at zero betas: SMPL-X's, so that its clips are in place in code that is
/// written for SMPL-X.
inline const Eigen::Vector3d kEmbeddedRestPelvis = kSmplxRestPelvis;

}  // namespace holdfast
