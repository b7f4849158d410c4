// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/body_kinematics.h"
#include "generator/wandr/pose.h"
#include "geometry/body/body_model.h"

namespace holdfast::wandr {

/// Finds the lowest vertex of a posed body, skinning only those few that can be: vertices in small
/// clusters, and for each a bound, since skinning is a convex combination,
///   z_i >= min_j (e_z . A_j x + t_j) over joints j of the cluster's weights and x in its box,
/// less the most that pose blend shapes can move it. Fingers, jaw and eyes are at rest.
/// Const and shareable.
class LowestPoint {
 public:
  /// One person's surface, all of its vertices.
  explicit LowestPoint(const BodySurface& surface);

  /// A body in one pose.
  struct Placed {
    std::array<Eigen::Matrix3d, kNumBodyJoints> rotation;          ///< A_j^R, world
    Eigen::Matrix<double, 3, kNumBodyJoints> offset;               ///< A_j^t + trans, metres
    std::array<Eigen::Matrix<double, 9, 1>, kNumBodyJoints> bend;  ///< R_j - I, row-major
    std::array<double, kNumBodyJoints> bend_norm;
  };
  void Place(const Pose<double>& pose, Placed& placed) const;

  int NumVertices() const { return static_cast<int>(rest_.cols()); }
  /// Vertex i of the surface, world, metres.
  Eigen::Vector3d Vertex(const Placed& placed, int i) const;
  /// The vertex with the least z, the first of equals. `guess` is any vertex: a good one (the last
  /// frame's) saves time and changes nothing.
  int Find(const Placed& placed, int guess = 0) const;

 private:
  struct Weight {
    int joint;
    double value;
  };
  struct Corrective {
    int joint;
    Eigen::Matrix<double, 3, 9> dirs;
  };
  struct Cluster {
    std::vector<int> vertices;
    std::vector<int> joints;          // with any weight
    Eigen::Vector3d centre, half;     // box of rest vertices
    std::vector<Weight> bend_bounds;  // per joint, the largest norm of its correctives
  };
  void GatherWeights(const BodySurface& surface);
  void GatherCorrectives(const BodySurface& surface);
  void Split(std::vector<int> vertices);
  double Bound(const Placed& placed, const Cluster& cluster) const;

  BoneOffsets<double> bones_;
  Eigen::Matrix3Xd rest_joints_;
  Eigen::Matrix3Xd rest_;
  std::vector<std::vector<Weight>> weights_;          // by vertex, joints 0..21
  std::vector<std::vector<Corrective>> correctives_;  // by vertex
  std::vector<Cluster> clusters_;
};

/// FS as the paper and its code have it: share of pairs of frames in which the vertex that is
/// lowest in the first moves horizontally by more than 2/3 cm. `states` (135 x F); frames from the
/// first that is not all numbers are left out. Zero for fewer than two frames.
double SkatingOfLowestVertex(const LowestPoint& body,
                             const Eigen::Ref<const StateMatrix<float>>& states);

}  // namespace holdfast::wandr
