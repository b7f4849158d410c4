// SPDX-License-Identifier: MIT
#include "solver/reach/reach_obstacle.h"

#include <utility>

#include "generator/wandr/reach_goals.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {

double ReachObstacle::Distance(const Eigen::Vector3d& point, Side side) const {
  return distance->Distance(side == Side::kLeft ? wandr::MirroredPoint(point) : point);
}

ReachObstacle MakeObstacle(std::string name, TriangleMesh mesh, Side side, int threads) {
  ReachObstacle obstacle{std::move(name), std::move(mesh), nullptr};
  TriangleMesh seen = obstacle.mesh;
  if (side == Side::kLeft) {
    seen.vertices.row(0) *= -1.0;
    seen.faces.row(1).swap(seen.faces.row(2));
  }
  DistanceGridOptions grid;
  grid.cell_m = 0.02;
  grid.padding_m = 0.3;
  grid.threads = threads;
  obstacle.distance = std::make_shared<DistanceGrid>(SignedDistance(seen), grid);
  return obstacle;
}

}  // namespace holdfast
