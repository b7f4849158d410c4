// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/import/fields.h"

namespace holdfast {

/// The rotation that carries `up` to +z and turns the other axes as little as possible.
Eigen::Matrix3d ZUpFrom(WorldUp up);

/// Turns the world of a clip: x -> Q x for body, object and table. A root turns about the pelvis
/// J_0 of the rest pose, so trans' = Q (J_0 + trans) - J_0.
void TurnWorld(Clip& clip, const Eigen::Matrix3d& Q, const Eigen::Vector3d& pelvis);

/// Moves body, object and table.
void MoveWorld(Clip& clip, const Eigen::Vector3d& offset);

/// The rest pose's pelvis of the clip's person on `body`: of its own v_template where that has the
/// body's vertices, else of the betas where they are the body's, else of the mean shape: SMPL-H's
/// of a clip of SMPL-H where `body` is none, and SMPL-X's the other way round.
Eigen::Vector3d PelvisOf(const Clip& clip, const BodyModel& body);

/// The axis along which the body surely stands upright; nothing where it does not for long.
std::optional<WorldUp> UprightAxis(const Clip& clip, const BodyModel& body);

/// Brings an imported clip into a world with z up and, with `find_ground`, the floor at z = 0.
/// `known` is the format's axis, `options.up` comes before it; without either the axis nearest to
/// head minus feet is taken, and noted. The floor is where the feet come down to.
void SettleWorld(ImportedClip& imported, const ParameterOptions& options,
                 std::optional<WorldUp> known, bool find_ground);

}  // namespace holdfast
