// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Places on a head that objects are brought to. Frame: that of the head joint in the rest pose,
/// origin at the joint, y up, z where the face looks, x to the person's left; metres.
struct FaceMarks {
  Eigen::Vector3d eyes = Eigen::Vector3d(0.0, 0.05, 0.09);        ///< between both
  Eigen::Vector3d mouth = Eigen::Vector3d(0.0, -0.01, 0.1);       ///< on the skin
  Eigen::Vector3d right_ear = Eigen::Vector3d(-0.08, 0.04, 0.0);  ///< on the skin, outermost
  TriangleMesh head;  ///< skin of head and upper neck, closed below
};

/// Finds the marks on the skin of the rest pose. The tip of the nose is what is foremost on the
/// midline above the head joint; the mouth is as far below it as 1.2 times the eyes are above; the
/// ear is what is outermost within 2 cm below the eyes. `body` is a whole body. Throws Error for
/// one without a head.
FaceMarks FindFaceMarks(const BodySurface& body);

}  // namespace holdfast
