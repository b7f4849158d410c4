// SPDX-License-Identifier: MIT
#include "meshes/make/body/body_skeleton.h"

#include <cmath>
#include <numbers>

namespace holdfast {
namespace {

using Eigen::Vector3d;

const Vector3d kWristAt(0.6508, 0.4462, 0.0050);

/// A finger in the frame of the left hand (x to the fingertips, y out of the back of the hand,
/// z to the thumb), origin at the wrist: base joint in millimetres, lengths of the three segments
/// (the last one to the tip), spread towards the thumb and drop towards the palm in degrees.
struct FingerMeasures {
  Vector3d base_mm;
  std::array<double, 3> length_mm;
  std::array<double, 3> spread_deg;
  std::array<double, 3> drop_deg;
};

/// Phalanx lengths of an adult hand of 0.18 m; the fan keeps the fingers apart at rest.
const std::array<FingerMeasures, kNumFingers> kFingers = {{
    {{83, -2, 24.5}, {41, 24, 23}, {7, 5, 4}, {4, 8, 12}},
    {{86, -1, 3}, {45, 28, 24}, {0.5, 0, 0}, {4, 8, 12}},
    {{71, -5, -37}, {33, 19, 20.5}, {-16, -13, -12}, {4, 8, 12}},
    {{81, -2, -17.5}, {41.5, 26, 23.5}, {-7, -5.5, -5}, {4, 8, 12}},
    {{21, -9, 22}, {43, 32, 28}, {50, 41, 36}, {24, 19, 17}},
}};

Vector3d Direction(double spread_deg, double drop_deg) {
  const double spread = spread_deg * std::numbers::pi / 180.0;
  const double drop = drop_deg * std::numbers::pi / 180.0;
  return {std::cos(drop) * std::cos(spread), -std::sin(drop), std::cos(drop) * std::sin(spread)};
}

}  // namespace

FingerChain LeftFingerChain(Finger finger) {
  const FingerMeasures& measures = kFingers[finger];
  FingerChain chain;
  chain.points[0] = kWristAt + 1e-3 * measures.base_mm;
  for (int k = 0; k < 3; ++k) {
    chain.joints[k] = kLeftHandBegin + 3 * finger + k;
    chain.points[k + 1] =
        chain.points[k] +
        1e-3 * measures.length_mm[k] * Direction(measures.spread_deg[k], measures.drop_deg[k]);
  }
  return chain;
}

RestJoints DefaultRestJoints() {
  RestJoints joints = RestJoints::Zero();
  const auto set = [&](std::string_view name, double x, double y, double z) {
    joints.col(*FindJoint(name)) << x, y, z;
  };
  set("pelvis", 0, 0, 0);
  set("spine1", 0, 0.0900, -0.0150);
  set("spine2", 0, 0.1850, -0.0100);
  set("spine3", 0, 0.2800, -0.0100);
  set("neck", 0, 0.5250, -0.0120);
  set("head", 0, 0.6250, 0.0150);
  set("jaw", 0, 0.6430, 0.0450);
  set("left_hip", 0.0920, -0.0250, 0.0000);
  set("left_knee", 0.1180, -0.4080, -0.0060);
  set("left_ankle", 0.1290, -0.8060, -0.0260);
  set("left_foot", 0.1370, -0.8580, 0.0960);
  set("left_collar", 0.0400, 0.4500, -0.0050);
  set("left_shoulder", 0.1680, 0.4440, -0.0020);
  set("left_elbow", 0.4117, 0.4450, 0.0000);
  joints.col(*FindJoint("left_wrist")) = kWristAt;
  set("left_eye", 0.0300, 0.6780, 0.0980);
  for (int f = 0; f < kNumFingers; ++f) {
    const FingerChain chain = LeftFingerChain(static_cast<Finger>(f));
    for (int k = 0; k < 3; ++k) joints.col(chain.joints[k]) = chain.points[k];
  }
  for (int j = 0; j < kNumJoints; ++j) {
    if (!kJointNames[j].starts_with("left_")) continue;
    joints.col(MirrorJoint(j)) = Vector3d(-joints(0, j), joints(1, j), joints(2, j));
  }
  return joints;
}

}  // namespace holdfast
