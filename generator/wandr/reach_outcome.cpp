// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_outcome.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "generator/wandr/pose.h"
#include "geometry/error.h"

namespace holdfast::wandr {
namespace {

constexpr std::array kFootJoints = {7, 8, 10, 11};  // ankles and balls of the feet
constexpr double kSkatingPerFrame = 0.02 / 3.0;     // meters per frame
constexpr double kAirborneAnkleOrBall = 0.12;       // meters above the floor

using Joints = Eigen::Ref<const Eigen::MatrixXf>;

Eigen::Vector3d JointAt(const Joints& joints, int joint, int frame) {
  return joints.block<3, 1>(3 * joint, frame).cast<double>();
}

int LowestFootJoint(const Joints& joints, int frame) {
  return *std::ranges::min_element(kFootJoints, {},
                                   [&](int joint) { return joints(3 * joint + 2, frame); });
}

double MeanAcceleration(const Joints& joints, int frames) {
  if (frames < 3) return 0.0;
  double sum = 0.0;
  for (int f = 1; f + 1 < frames; ++f) {
    for (int k = 0; k < kNumBodyJoints; ++k) {
      sum += (JointAt(joints, k, f + 1) - 2.0 * JointAt(joints, k, f) + JointAt(joints, k, f - 1))
                 .norm();
    }
  }
  return sum * kFramesPerSecond * kFramesPerSecond / (kNumBodyJoints * (frames - 2.0));
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace

ReachOutcome MeasureReach(const Eigen::Ref<const Eigen::MatrixXf>& joints,
                          const Eigen::Vector3d& goal, Side wrist) {
  int frames = 0;
  while (frames < joints.cols() && joints.col(frames).allFinite()) ++frames;
  if (joints.rows() != kJointNumbers || frames == 0) {
    throw Error("motion", "it has no frame with 22 finite joints", "Check its start pose");
  }
  if (!goal.allFinite()) {
    throw Error("goal", "it is not finite", "Give three numbers, meters");
  }
  ReachOutcome outcome;
  outcome.diverged = frames < joints.cols();
  outcome.closest_m = std::numeric_limits<double>::infinity();
  const int rest = std::max(0, frames - 1 - static_cast<int>(kFramesPerSecond) / 2);
  int skating = 0, airborne = 0;
  for (int f = 0; f < frames; ++f) {
    outcome.last_m = (JointAt(joints, WristJoint(wrist), f) - goal).norm();
    if (outcome.last_m < outcome.closest_m) {
      outcome.closest_m = outcome.last_m;
      outcome.closest_frame = f;
    }
    if (f >= rest) outcome.rest_m = std::max(outcome.rest_m, outcome.last_m);
    if (outcome.last_m <= kReachedWithin && !outcome.Reached()) outcome.reached_frame = f;
    const int lowest = LowestFootJoint(joints, f);
    const Eigen::Vector3d foot = JointAt(joints, lowest, f);
    if (foot.z() > kAirborneAnkleOrBall) ++airborne;
    if (f + 1 == frames) break;
    const Eigen::Vector3d way = JointAt(joints, lowest, f + 1) - foot;
    if (way.head<2>().norm() > kSkatingPerFrame) ++skating;
    const double speed =
        (JointAt(joints, 0, f + 1) - JointAt(joints, 0, f)).norm() * kFramesPerSecond;
    outcome.peak_pelvis_m_s = std::max(outcome.peak_pelvis_m_s, speed);
  }
  outcome.skating_share = static_cast<double>(skating) / std::max(frames - 1, 1);
  outcome.airborne_share = static_cast<double>(airborne) / frames;
  outcome.mean_acceleration_m_s2 = MeanAcceleration(joints, frames);
  return outcome;
}

ReachSummary Summarize(std::span<const ReachOutcome> outcomes) {
  if (outcomes.empty()) {
    throw Error("reach summary", "there are no motions", "Run at least one");
  }
  ReachSummary summary;
  const auto count = static_cast<double>(outcomes.size());
  std::vector<double> distances;
  int reached = 0;
  for (const ReachOutcome& outcome : outcomes) {
    reached += outcome.Reached();
    distances.push_back(outcome.closest_m);
    summary.distance_mean_m += outcome.closest_m / count;
    summary.skating += outcome.skating_share / count;
    summary.airborne += outcome.airborne_share / count;
    summary.acceleration_m_s2 += outcome.mean_acceleration_m_s2 / count;
  }
  summary.success = reached / count;
  summary.distance_median_m = Median(std::move(distances));
  return summary;
}

namespace {

constexpr std::size_t kClusterSize = 24;

// Returns the body joint that moves `joint`; its descendants outside the body are at rest.
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
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    if (block.joint >= kNumBodyJoints) continue;
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      correctives_[block.vertices[k]].push_back(
          {block.joint, block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k))});
    }
  }
  // Vertices moved mostly by the same joint are near each other in any pose.
  std::map<int, std::vector<int>> of_joint;
  for (int i = 0; i < NumVertices(); ++i) {
    std::map<int, double> sums;
    for (const auto& [joint, weight] : surface.Weights(i)) sums[BodyJointOf(joint)] += weight;
    std::erase_if(sums, [](const auto& sum) { return sum.second == 0.0; });
    weights_[i].assign(sums.begin(), sums.end());
    const auto most = std::ranges::max_element(weights_[i], {}, &std::pair<int, double>::second);
    of_joint[most->first].push_back(i);
  }
  for (auto& [joint, vertices] : of_joint) Split(std::move(vertices));
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
  std::set<int> joints;
  for (const int i : vertices) {
    for (const auto& [joint, weight] : weights_[i]) joints.insert(joint);
    for (const Corrective& corrective : correctives_[i]) {
      double& bend = bends[corrective.joint];
      bend = std::max(bend, corrective.dirs.norm());
    }
  }
  Cluster cluster;
  cluster.center = 0.5 * (low + high);
  cluster.half = 0.5 * (high - low);
  cluster.joints.assign(joints.begin(), joints.end());
  cluster.bend_bounds.assign(bends.begin(), bends.end());
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
  for (const auto& [joint, weight] : weights_[i]) {
    vertex += weight * (placed.rotation[joint] * posed + placed.offset.col(joint));
  }
  return vertex;
}

double LowestPoint::Bound(const Placed& placed, const Cluster& cluster) const {
  double bound = INFINITY;
  for (const int j : cluster.joints) {
    const auto up = placed.rotation[j].row(2);
    bound = std::min(
        bound, up.dot(cluster.center) - up.cwiseAbs().dot(cluster.half) + placed.offset(2, j));
  }
  for (const auto& [joint, bend] : cluster.bend_bounds) bound -= bend * placed.bend_norm[joint];
  return bound;
}

int LowestPoint::Find(const Placed& placed, int guess) const {
  constexpr double kRounding = 1e-9;  // of weights that do not sum to exactly 1, meters
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
