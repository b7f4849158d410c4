// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_skating.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "generator/wandr/reach_outcome.h"

namespace holdfast::wandr {
namespace {

constexpr std::size_t kClusterSize = 24;

// The body joint that moves `joint`, whatever hangs on it being at rest.
int BodyJointOf(int joint) {
  while (joint >= kNumBodyJoints) joint = kJointParents[joint];
  return joint;
}

}  // namespace

LowestPoint::LowestPoint(const BodySurface& surface)
    : bones_(BoneOffsetsOf(surface.RestJoints())),
      rest_joints_(surface.RestJoints()),
      rest_(surface.RestVertices()),
      weights_(surface.NumVertices()),
      correctives_(surface.NumVertices()) {
  GatherWeights(surface);
  GatherCorrectives(surface);
  // Vertices that one joint moves most are near each other in any pose.
  std::map<int, std::vector<int>> of_joint;
  for (int i = 0; i < NumVertices(); ++i) {
    const auto most =
        std::max_element(weights_[i].begin(), weights_[i].end(),
                         [](const Weight& a, const Weight& b) { return a.value < b.value; });
    of_joint[most->joint].push_back(i);
  }
  for (auto& [joint, vertices] : of_joint) Split(std::move(vertices));
}

void LowestPoint::GatherWeights(const BodySurface& surface) {
  for (int i = 0; i < NumVertices(); ++i) {
    std::map<int, double> sums;
    for (const auto& [joint, weight] : surface.Weights(i)) sums[BodyJointOf(joint)] += weight;
    for (const auto& [joint, weight] : sums) {
      if (weight != 0.0) weights_[i].push_back({joint, weight});
    }
  }
}

void LowestPoint::GatherCorrectives(const BodySurface& surface) {
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    if (block.joint >= kNumBodyJoints) continue;
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      correctives_[block.vertices[k]].push_back(
          {block.joint, block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k))});
    }
  }
}

void LowestPoint::Split(std::vector<int> vertices) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
  for (const int i : vertices) {
    low = low.cwiseMin(rest_.col(i));
    high = high.cwiseMax(rest_.col(i));
  }
  if (vertices.size() > kClusterSize) {
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const auto middle = vertices.begin() + static_cast<std::ptrdiff_t>(vertices.size() / 2);
    std::nth_element(vertices.begin(), middle, vertices.end(), [&](int a, int b) {
      return std::pair(rest_(axis, a), a) < std::pair(rest_(axis, b), b);
    });
    Split({vertices.begin(), middle});
    Split({middle, vertices.end()});
    return;
  }
  std::map<int, double> bends;
  std::map<int, bool> joints;
  for (const int i : vertices) {
    for (const Weight& weight : weights_[i]) joints[weight.joint] = true;
    for (const Corrective& corrective : correctives_[i]) {
      double& bend = bends[corrective.joint];
      bend = std::max(bend, corrective.dirs.norm());
    }
  }
  Cluster cluster;
  cluster.centre = 0.5 * (low + high);
  cluster.half = 0.5 * (high - low);
  for (const auto& [joint, any] : joints) cluster.joints.push_back(joint);
  for (const auto& [joint, bend] : bends) cluster.bend_bounds.push_back({joint, bend});
  std::sort(vertices.begin(), vertices.end());
  cluster.vertices = std::move(vertices);
  clusters_.push_back(std::move(cluster));
}

void LowestPoint::Place(const Pose<double>& pose, Placed& placed) const {
  BodyKinematics<double> kinematics;
  ForwardKinematics(bones_, pose, kinematics);
  for (int k = 0; k < kNumBodyJoints; ++k) {
    placed.rotation[k] = kinematics.world[k];
    placed.offset.col(k) = kinematics.joints.col(k) - kinematics.world[k] * rest_joints_.col(k);
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> bend =
        pose.rotation[k] - Eigen::Matrix3d::Identity();
    placed.bend[k] = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(bend.data());
    placed.bend_norm[k] = bend.norm();
  }
}

Eigen::Vector3d LowestPoint::Vertex(const Placed& placed, int i) const {
  Eigen::Vector3d posed = rest_.col(i);
  for (const Corrective& corrective : correctives_[i]) {
    posed.noalias() += corrective.dirs * placed.bend[corrective.joint];
  }
  Eigen::Vector3d vertex = Eigen::Vector3d::Zero();
  for (const Weight& weight : weights_[i]) {
    vertex +=
        weight.value * (placed.rotation[weight.joint] * posed + placed.offset.col(weight.joint));
  }
  return vertex;
}

double LowestPoint::Bound(const Placed& placed, const Cluster& cluster) const {
  double bound = INFINITY;
  for (const int j : cluster.joints) {
    const auto up = placed.rotation[j].row(2);
    bound = std::min(
        bound, up.dot(cluster.centre) - up.cwiseAbs().dot(cluster.half) + placed.offset(2, j));
  }
  for (const Weight& bend : cluster.bend_bounds) bound -= bend.value * placed.bend_norm[bend.joint];
  return bound;
}

int LowestPoint::Find(const Placed& placed, int guess) const {
  constexpr double kRounding = 1e-9;  // of weights that do not sum to 1 exactly, metres
  int lowest = guess;
  double height = Vertex(placed, guess).z();
  for (const Cluster& cluster : clusters_) {
    if (Bound(placed, cluster) > height + kRounding) continue;
    for (const int i : cluster.vertices) {
      const double z = Vertex(placed, i).z();
      if (z < height || (z == height && i < lowest)) {
        height = z;
        lowest = i;
      }
    }
  }
  return lowest;
}

double SkatingOfLowestVertex(const LowestPoint& body,
                             const Eigen::Ref<const StateMatrix<float>>& states) {
  LowestPoint::Placed here, next;
  int frames = 0, skating = 0, lowest = 0;
  for (; frames < states.cols() && states.col(frames).allFinite(); ++frames) {
    std::swap(here, next);
    body.Place(PoseOf<float>(states.col(frames)).Cast<double>(), next);
    if (frames == 0) continue;
    lowest = body.Find(here, lowest);
    const Eigen::Vector3d way = body.Vertex(next, lowest) - body.Vertex(here, lowest);
    if (way.head<2>().norm() > kSkatingPerFrame) ++skating;
  }
  return frames < 2 ? 0.0 : static_cast<double>(skating) / (frames - 1);
}

}  // namespace holdfast::wandr
