// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/import/fields.h"

namespace holdfast {

/// Words of an option for the up axis: auto (empty), x, y, z, -x, -y, -z.
std::vector<std::pair<std::string, std::optional<UpAxis>>> UpAxisChoices();

/// Rotation that takes `up` to +z and turns the other axes as little as possible.
Eigen::Matrix3d ZUpFrom(UpAxis up);

/// Rotates the world of a clip: x -> Q x for body, object and table. The root rotates about the
/// pelvis J_0 of the rest pose, so trans' = Q (J_0 + trans) - J_0.
void TurnWorld(Clip& clip, const Eigen::Matrix3d& Q, const Eigen::Vector3d& pelvis);

/// Rest-pose pelvis of the clip's person on `body`: from the clip's v_template if it has the body's
/// vertices, else from the betas if they are the body's, else from the mean shape. The latter is
/// SMPL-H's for a clip of SMPL-H if `body` is not SMPL-H, and SMPL-X's vice versa.
Eigen::Vector3d PelvisOf(const Clip& clip, const BodyModel& body);

/// Axis along which the body certainly stands upright; nullopt if it does not stand for long.
std::optional<UpAxis> UprightAxis(const Clip& clip, const BodyModel& body);

/// Transforms an imported clip to a world with z up and, with `find_ground`, the floor at z = 0.
/// `options.up` takes precedence over `known`, the format's up axis; without either, the axis
/// nearest to head minus feet is taken, with a note. The floor is where the feet come down to.
void SettleWorld(ImportedClip& imported, const ParameterOptions& options,
                 std::optional<UpAxis> known, bool find_ground);

}  // namespace holdfast
