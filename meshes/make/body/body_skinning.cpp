// SPDX-License-Identifier: MIT
#include "meshes/make/body/body_skinning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

namespace holdfast {
namespace {

using Eigen::RowVectorXd;
using Eigen::Vector3d;

constexpr int kMaxInfluences = 4;
constexpr int kSmoothingRounds = 3;

/// 0 below `from`, 1 above `to`, smooth in between.
double Ramp(double value, double from, double to) {
  const double t = std::clamp((value - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

double DistanceToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - t * ab).norm();
}

template <std::size_t N>
double DistanceToPolyline(const Vector3d& p, const std::array<Vector3d, N>& line) {
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k + 1 < N; ++k) {
    distance = std::min(distance, DistanceToSegment(p, line[k], line[k + 1]));
  }
  return distance;
}

/// Weights of one point with x >= 0, by how far along each bone it lies.
class WeightField {
 public:
  WeightField() : joints_(DefaultRestJoints()) {
    for (int f = 0; f < kNumFingers; ++f) fingers_[f] = LeftFingerChain(static_cast<Finger>(f));
  }

  RowVectorXd operator()(const Vector3d& p) const {
    RowVectorXd w = RowVectorXd::Zero(kNumJoints);
    // Arm: the plane through the shoulder leans out over the armpit.
    const Vector3d shoulder = At("left_shoulder");
    const double lean = 0.35 * std::min(p.y() - shoulder.y(), 0.04);
    const double arm = Ramp(p.x() - shoulder.x() + lean, -0.055, 0.060);
    const double forearm = Ramp(p.x() - At("left_elbow").x(), -0.042, 0.042);
    const double hand = Ramp(p.x() - At("left_wrist").x(), -0.026, 0.020);
    Put(w, "left_shoulder", arm * (1 - forearm));
    Put(w, "left_elbow", arm * forearm * (1 - hand));
    AddHand(p, arm * forearm * hand, w);
    AddTrunk(p, 1 - arm, w);
    return w;
  }

 private:
  Vector3d At(std::string_view name) const { return joints_.col(*FindJoint(name)); }
  static void Put(RowVectorXd& w, std::string_view name, double value) {
    w[*FindJoint(name)] += value;
  }

  void AddTrunk(const Vector3d& p, double mass, RowVectorXd& w) const {
    if (mass <= 0) return;
    const Vector3d hip = At("left_hip");
    const Vector3d down_and_out = Vector3d(0.30, -0.954, 0);
    const double legs = mass * Ramp(down_and_out.dot(p - hip), -0.060, 0.075);
    const double left = Ramp(p.x(), -0.030, 0.030);
    AddLeg(p, legs * left, "left_hip", "left_knee", "left_ankle", "left_foot", w);
    AddLeg(p, legs * (1 - left), "right_hip", "right_knee", "right_ankle", "right_foot", w);
    mass -= legs;

    // The girdle follows the collar bones, less and less towards breastbone and spine.
    const double neck = Ramp(p.y() + 0.25 * p.z(), 0.485, 0.555);
    const double girdle =
        mass * (1 - neck) * Ramp(p.x(), 0.015, 0.120) * Ramp(p.y() + 0.25 * p.x(), 0.380, 0.490);
    Put(w, "left_collar", girdle);
    mass -= girdle;

    const double height = p.y();
    const double spine1 = Ramp(height, 0.035, 0.145);
    const double spine2 = Ramp(height, 0.130, 0.240);
    const double spine3 = Ramp(height, 0.225, 0.335);
    const double head = Ramp(p.y() - 0.605 + 0.6 * (p.z() - 0.015), -0.030, 0.028);
    const double jaw = head * Ramp(0.610 - p.y(), -0.010, 0.016) * Ramp(p.z(), 0.030, 0.085);
    Put(w, "pelvis", mass * (1 - spine1));
    Put(w, "spine1", mass * spine1 * (1 - spine2));
    Put(w, "spine2", mass * spine2 * (1 - spine3));
    Put(w, "spine3", mass * spine3 * (1 - neck));
    Put(w, "neck", mass * spine3 * neck * (1 - head));
    Put(w, "head", mass * spine3 * neck * (head - jaw));
    Put(w, "jaw", mass * spine3 * neck * jaw);
  }

  void AddLeg(const Vector3d& p, double mass, std::string_view hip_name, std::string_view knee_name,
              std::string_view ankle_name, std::string_view toes_name, RowVectorXd& w) const {
    if (mass <= 0) return;
    const Vector3d knee = At(knee_name), ankle = At(ankle_name), toes = At(toes_name);
    const double shank = Ramp(knee.y() - p.y(), -0.063, 0.063);
    // From the instep down to the back of the heel.
    const double foot = Ramp(0.87 * (ankle.y() - p.y()) + 0.5 * (p.z() - ankle.z()), -0.035, 0.035);
    const double toe = foot * Ramp(p.z() - toes.z(), -0.020, 0.022);
    Put(w, hip_name, mass * (1 - shank));
    Put(w, knee_name, mass * shank * (1 - foot));
    Put(w, ankle_name, mass * shank * (foot - toe));
    Put(w, toes_name, mass * shank * toe);
  }

  /// How far p lies beyond joint k of a finger, along the bisector of the bones that meet there.
  double Beyond(const Vector3d& p, Finger finger, int k) const {
    const FingerChain& chain = fingers_[finger];
    const Vector3d root = finger == kThumb
                              ? Vector3d(chain.points[0] - (chain.points[1] - chain.points[0]))
                              : At("left_wrist");
    const Vector3d before = chain.points[k] - (k == 0 ? root : chain.points[k - 1]);
    const Vector3d after = chain.points[k + 1] - chain.points[k];
    return (p - chain.points[k]).dot((before.normalized() + after.normalized()).normalized());
  }

  void AddFinger(const Vector3d& p, Finger finger, double mass, double half_width,
                 RowVectorXd& w) const {
    const double second = Ramp(Beyond(p, finger, 1), -half_width, half_width);
    const double third = Ramp(Beyond(p, finger, 2), -0.87 * half_width, 0.87 * half_width);
    const auto& joints = fingers_[finger].joints;
    w[joints[0]] += mass * (1 - second);
    w[joints[1]] += mass * second * (1 - third);
    w[joints[2]] += mass * second * third;
  }

  void AddHand(const Vector3d& p, double mass, RowVectorXd& w) const {
    if (mass <= 0) return;
    constexpr std::array<Finger, 4> kFour = {kIndex, kMiddle, kRing, kPinky};
    constexpr std::array<double, kNumFingers> kHalfWidth = {0.0092, 0.0094, 0.0077, 0.0087, 0.0104};
    const Vector3d wrist = At("left_wrist");

    // Thumb: what is nearer to its bones than to those of the palm and the index.
    const auto& index = fingers_[kIndex].points;
    const double to_thumb = DistanceToPolyline(p, fingers_[kThumb].points);
    const double to_palm =
        std::min({DistanceToSegment(p, wrist, index[0]), DistanceToPolyline(p, index),
                  DistanceToSegment(p, wrist, fingers_[kMiddle].points[0])});
    const double thumb =
        mass * Ramp(to_palm - to_thumb, -0.014, 0.019) * Ramp(Beyond(p, kThumb, 0), -0.019, 0.021);
    AddFinger(p, kThumb, thumb, kHalfWidth[kThumb], w);
    mass -= thumb;

    // The others share the palm by distance, broadly at the knuckles; out at the webs only what is
    // nearly as near to one finger as to the next belongs to two.
    std::array<double, kNumFingers> share{};
    double nearest = std::numeric_limits<double>::infinity();
    std::array<double, kNumFingers> distance{};
    for (const Finger f : kFour) {
      distance[f] = DistanceToPolyline(p, fingers_[f].points);
      nearest = std::min(nearest, distance[f]);
    }
    double beyond = -1;
    for (const Finger f : kFour) {
      if (distance[f] == nearest) beyond = Beyond(p, f, 0);
    }
    const double reach = 1.8 - 0.6 * Ramp(beyond, 0.008, 0.021);
    double total = 0;
    for (const Finger f : kFour) {
      const double margin = std::max(0.0, reach * nearest + 1e-4 - distance[f]);
      share[f] = margin * margin;
      total += share[f];
    }
    double left_over = mass;
    for (const Finger f : kFour) {
      const double finger = mass * share[f] / total * Ramp(Beyond(p, f, 0), -0.0160, 0.0165);
      AddFinger(p, f, finger, kHalfWidth[f], w);
      left_over -= finger;
    }
    Put(w, "left_wrist", left_over);
  }

  RestJoints joints_;
  std::array<FingerChain, kNumFingers> fingers_;
};

RowVectorXd MirrorRow(const RowVectorXd& row) {
  RowVectorXd mirrored(row.size());
  for (int j = 0; j < kNumJoints; ++j) mirrored[MirrorJoint(j)] = row[j];
  return mirrored;
}

/// The left half decides; the midline is made even.
void Mirror(const BodyMesh& body, Eigen::MatrixXd& weights) {
  for (int i = 0; i < body.NumLeftAndMidline(); ++i) {
    const RowVectorXd row = weights.row(i);
    if (i < body.num_midline) {
      weights.row(i) = 0.5 * (row + MirrorRow(row));
    } else {
      weights.row(body.MirrorVertex(i)) = MirrorRow(row);
    }
  }
}

/// Keeps the largest few, and those above half a percent.
void Prune(Eigen::MatrixXd& weights) {
  for (Eigen::Index i = 0; i < weights.rows(); ++i) {
    std::array<std::pair<double, int>, kNumJoints> sorted;
    for (int j = 0; j < kNumJoints; ++j) sorted[j] = {-weights(i, j), j};
    std::sort(sorted.begin(), sorted.end());
    // Equal weights on both sides stand or fall together: the midline stays even.
    const double smallest = std::max(-sorted[kMaxInfluences].first * (1 + 1e-9), 0.005);
    for (int j = 0; j < kNumJoints; ++j) {
      if (weights(i, j) <= smallest) weights(i, j) = 0;
    }
    weights.row(i) /= weights.row(i).sum();
  }
}

}  // namespace

Eigen::MatrixXd SmoothedWeights(const BodyMesh& body, const Eigen::MatrixXd& weights, int rounds) {
  const auto neighbours = VertexNeighbours(body.mesh);
  const double wrist_x = DefaultRestJoints()(0, WristJoint(Side::kLeft));
  Eigen::MatrixXd now = weights, next = weights;
  for (int round = 0; round < rounds; ++round) {
    for (int i = 0; i < body.NumLeftAndMidline(); ++i) {
      if (body.mesh.vertices(0, i) > wrist_x - 0.04) continue;
      RowVectorXd mean = RowVectorXd::Zero(kNumJoints);
      for (const int n : neighbours[i]) mean += now.row(n);
      next.row(i) = 0.5 * now.row(i) + 0.5 / static_cast<double>(neighbours[i].size()) * mean;
    }
    Mirror(body, next);
    now = next;
  }
  return now;
}

Eigen::MatrixXd SkinningWeights(const BodyMesh& body) {
  const WeightField field;
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(body.mesh.NumVertices(), kNumJoints);
  for (int i = 0; i < body.NumLeftAndMidline(); ++i) {
    weights.row(i) = field(body.mesh.vertices.col(i));
  }
  Mirror(body, weights);
  weights = SmoothedWeights(body, weights, kSmoothingRounds);
  Prune(weights);
  return weights;
}

Eigen::VectorXd SubtreeWeights(const Eigen::MatrixXd& weights, int joint) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(weights.rows());
  for (int j = 0; j < kNumJoints; ++j) {
    int ancestor = j;
    while (ancestor > joint) ancestor = kJointParents[ancestor];
    if (ancestor == joint) sum += weights.col(j);
  }
  return sum;
}

Eigen::VectorXd AncestorWeights(const Eigen::MatrixXd& weights, int joint) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(weights.rows());
  for (int j = kJointParents[joint]; j >= 0; j = kJointParents[j]) sum += weights.col(j);
  return sum;
}

}  // namespace holdfast
