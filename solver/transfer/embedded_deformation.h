// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include <ceres/rotation.h>
#include <Eigen/Core>

namespace holdfast {

/// A node of an embedded deformation (Sumner, Schmid, Pauly 2007): maps nearby points x to R (x -
/// g) + g + t.
struct DeformationNode {
  Eigen::Vector3d at;                                  ///< g
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< R
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();     ///< t
};

inline constexpr int kNodesOfPoint = 4;

/// Nodes near a point with their weights, which sum to 1.
struct NodeWeights {
  std::array<int, kNodesOfPoint> node{};
  std::array<double, kNodesOfPoint> weight{};
};

/// Returns the nearest nodes with weights (1 - d / d_5)^2 for distances d.
inline NodeWeights WeightsAt(const std::vector<DeformationNode>& nodes,
                             const Eigen::Vector3d& point) {
  constexpr int kNearest = kNodesOfPoint + 1;  // the last one sets the distance of zero weight
  std::array<std::pair<double, int>, kNearest> nearest;
  nearest.fill({std::numeric_limits<double>::infinity(), 0});
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    std::pair<double, int> candidate((nodes[k].at - point).norm(), static_cast<int>(k));
    for (auto& held : nearest) {
      if (candidate < held) std::swap(candidate, held);
    }
  }
  NodeWeights found;
  double sum = 0.0;
  for (int k = 0; k < kNodesOfPoint; ++k) {
    found.node[k] = nearest[k].second;
    const double share = 1.0 - nearest[k].first / (nearest.back().first + 1e-12);
    found.weight[k] = std::max(1e-9, share * share);
    sum += found.weight[k];
  }
  for (double& weight : found.weight) weight /= sum;
  return found;
}

/// Residual between a deformed point and its goal: along the surface normal at the goal, and weakly
/// in all directions.
struct GoalOfPoint {
  Eigen::Vector3d point;
  std::array<Eigen::Vector3d, kNodesOfPoint> nodes;
  std::array<double, kNodesOfPoint> weights;
  Eigen::Vector3d goal, normal;
  double along, across;

  template <typename T>
  bool operator()(const T* a, const T* b, const T* c, const T* d, T* residuals) const {
    const T* const unknowns[kNodesOfPoint] = {a, b, c, d};
    T bent[3] = {T(0), T(0), T(0)};
    for (int k = 0; k < kNodesOfPoint; ++k) {
      const T offset[3] = {T(point.x() - nodes[k].x()), T(point.y() - nodes[k].y()),
                           T(point.z() - nodes[k].z())};
      T turned[3];
      ceres::AngleAxisRotatePoint(unknowns[k], offset, turned);
      for (int i = 0; i < 3; ++i) {
        bent[i] += weights[k] * (turned[i] + nodes[k](i) + unknowns[k][3 + i]);
      }
    }
    residuals[3] = T(0);
    for (int i = 0; i < 3; ++i) {
      const T off = bent[i] - goal(i);
      residuals[i] = across * off;
      residuals[3] += along * normal(i) * off;
    }
    return true;
  }
};

/// Rigidity residual: a node moves its neighbor as the neighbor moves itself.
struct RigidNeighbors {
  Eigen::Vector3d edge;  // to the neighbor
  double weight;

  template <typename T>
  bool operator()(const T* own, const T* neighbor, T* residuals) const {
    const T along[3] = {T(edge.x()), T(edge.y()), T(edge.z())};
    T turned[3];
    ceres::AngleAxisRotatePoint(own, along, turned);
    for (int i = 0; i < 3; ++i) {
      residuals[i] = weight * (turned[i] + own[3 + i] - along[i] - neighbor[3 + i]);
    }
    return true;
  }
};

}  // namespace holdfast
