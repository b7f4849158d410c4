// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {

/// Returns, per frame, 1 if the object is in mid-air: it is still (its center slower than 2 cm/s),
/// the person's skin is more than 1 cm away, and neither the ground nor the clip's table is within
/// 2 cm of its lowest points. A table without a mesh is taken to support the object.
/// `object`: in the object's own frame, meters; `distance`: of its surface.
std::vector<std::uint8_t> FramesInMidAir(const Clip& clip, const BodySurface& body,
                                         const TriangleMesh& object,
                                         const SignedDistance& distance);

}  // namespace holdfast
