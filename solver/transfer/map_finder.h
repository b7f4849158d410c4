// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/nearest.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/transfer/surface_map.h"

namespace holdfast {

/// Finds a map in its steps: turned and scaled, then bent. Used once, by one of its two methods.
class MapFinder {
 public:
  MapFinder(const TriangleMesh& from, const TriangleMesh& to, const SurfaceMapOptions& options);
  SurfaceMap ByShape();
  SurfaceMap ByPairs(const Eigen::Matrix3Xd& on_from, const Eigen::Matrix3Xd& on_to);

 private:
  struct Match {
    Eigen::Vector3d placed, goal, normal;  // no normal: the goal itself
  };
  // Points with their normals as places: the two sides of a wall are apart.
  Eigen::Matrix3Xd Lifted(const OrientedPoints& points) const;
  double Lift() const { return std::clamp(0.06 * size_, 0.002, 0.010); }

  // Q, s and b for a turn: boxes onto each other.
  void SetPlaced(const Eigen::Matrix3d& turn, SurfaceMap& map) const;
  OrientedPoints Moved(const SurfaceMap& map) const;
  // Mean squared distance of lifted points, both ways; every `stride`-th counts.
  double Mismatch(const SurfaceMap& map, int stride) const;
  // Among turns that are as good within a fifth, the least, and no tilt if that may be.
  void Align();
  // The mismatch with what turning costs: up to a tenth for a tilt, a tenth for the angle. A floor
  // of what sampling alone makes.
  double Cost(double mismatch, const Eigen::Matrix3d& turn) const;
  // ICP of the turn alone; boxes give scale and place.
  Eigen::Matrix3d Iterated(Eigen::Matrix3d turn);
  // The similarity that takes the pairs onto each other best.
  void PlaceByPairs(const Eigen::Matrix3Xd& on_from, const Eigen::Matrix3Xd& on_to);
  // Nodes evenly over the placed surface: each the farthest from those before.
  void MakeNodes();
  void BendToShape(double stiffness);
  void Bend(const std::vector<Match>& matches, double stiffness);

  SurfaceMapOptions options_;
  SignedDistance from_surface_;
  OrientedPoints from_, to_;
  double size_ = 0.0;  // of the second object, its diagonal
  std::optional<NearestPoints> to_tree_;
  std::vector<std::pair<std::size_t, std::size_t>> edges_;
  SurfaceMap map_;
};

}  // namespace holdfast
