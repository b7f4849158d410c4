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

/// Computes a map in steps: rotation and scale, then deformation. Call one method, once.
class MapFinder {
 public:
  MapFinder(const TriangleMesh& from, const TriangleMesh& to);
  SurfaceMap ByShape();
  SurfaceMap ByPairs(const Eigen::Matrix3Xd& on_from, const Eigen::Matrix3Xd& on_to);

 private:
  struct Match {
    Eigen::Vector3d placed, goal, normal;  // zero normal: point-to-point
  };
  // Points offset along their normals, which separates the two sides of a wall.
  Eigen::Matrix3Xd Lifted(const OrientedPoints& points) const;
  double Lift() const { return std::clamp(0.06 * size_, 0.002, 0.010); }

  // Sets Q, s and b for a rotation, aligning the bounding boxes.
  void SetPlaced(const Eigen::Matrix3d& turn, SurfaceMap& map) const;
  OrientedPoints Moved(const SurfaceMap& map) const;
  // Mean squared distance of lifted points, in both directions; uses every `stride`-th.
  double Mismatch(const SurfaceMap& map, int stride) const;
  // Among rotations of cost within a fifth, prefers the smallest, without tilt if possible.
  void Align();
  // The mismatch times a rotation penalty: up to a tenth for tilt, a tenth for the angle. Includes
  // a floor for the sampling error.
  double Cost(double mismatch, const Eigen::Matrix3d& turn) const;
  // ICP over the rotation; the boxes determine scale and position.
  Eigen::Matrix3d Iterated(Eigen::Matrix3d turn);
  // The best similarity transform between the pairs.
  void PlaceByPairs(const Eigen::Matrix3Xd& on_from, const Eigen::Matrix3Xd& on_to);
  // Farthest-point sampling of nodes on the placed surface.
  void MakeNodes();
  void BendToShape(double stiffness);
  void Bend(const std::vector<Match>& matches, double stiffness);

  SignedDistance from_surface_;
  OrientedPoints from_, to_;
  double size_ = 0.0;  // diagonal of the second object
  std::optional<NearestPoints> to_tree_;
  std::vector<std::pair<std::size_t, std::size_t>> edges_;
  SurfaceMap map_;
};

}  // namespace holdfast
