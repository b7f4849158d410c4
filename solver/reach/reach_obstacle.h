// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "geometry/body/skeleton.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A solid to keep out of, in the world.
struct ReachObstacle {
  std::string name;
  TriangleMesh mesh;
  /// What optimised joints keep out of; its own mirror image where the left wrist reaches.
  std::shared_ptr<const DistanceGrid> distance;

  /// Metres from the surface, negative inside; `point` is in the world, not mirrored.
  double Distance(const Eigen::Vector3d& point, Side side) const;
};

/// Throws Error for a mesh without an inside.
ReachObstacle MakeObstacle(std::string name, TriangleMesh mesh, Side side, int threads);

}  // namespace holdfast
