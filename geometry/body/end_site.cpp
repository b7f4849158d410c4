// SPDX-License-Identifier: MIT
#include "geometry/body/end_site.h"

namespace holdfast {

Eigen::Vector3d EndSite(const BodySurface& surface, int joint) {
  Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
  for (int v = 0; v < surface.NumVertices(); ++v) {
    for (const auto& [other, weight] : surface.Weights(v)) {
      if (other != joint || weight <= 0.5) continue;
      const Eigen::Vector3d offset =
          surface.RestVertices().col(v) - surface.RestJoints().col(joint);
      if (offset.squaredNorm() > farthest.squaredNorm()) farthest = offset;
    }
  }
  return farthest;
}

}  // namespace holdfast
