// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// The clip's 55 joints as a Biovision hierarchy, offsets those of the shaped body in its T-pose.
/// Lengths are centimetres, world y up (x, z, -y of the clip), as most programs expect. The root
/// has position and rotation channels, all others rotation only, as Z X Y Euler angles (R = Rz Rx
/// Ry) in degrees that go on smoothly from frame to frame. End sites lie on the skin: the vertex of
/// the joint farthest from it. The joint positions of the text are the clip's within a micrometre.
std::string BvhText(const Clip& clip, const BodySurface& surface);

/// Writes BvhText atomically.
void WriteBvh(const Clip& clip, const BodySurface& surface, const std::filesystem::path& path);

}  // namespace holdfast
