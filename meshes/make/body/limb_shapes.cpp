// SPDX-License-Identifier: MIT
#include "meshes/make/body/body_shape.h"

namespace holdfast {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

Vector3d JointAt(std::string_view name) { return DefaultRestJoints().col(*FindJoint(name)); }

}  // namespace

Sculpture MakeLeftArm() {
  const Vector3d shoulder = JointAt("left_shoulder");
  const Vector3d elbow = JointAt("left_elbow");
  const Vector3d wrist = JointAt("left_wrist");
  Sculpture arm(AlignedBox3d(Vector3d(0.09, 0.35, -0.08), Vector3d(0.67, 0.53, 0.08)), 0.06);
  // u up, v forward: at, centre (up, forward), half widths down, up, back, front.
  arm.Add(Loft(shoulder, elbow, kY, kZ,
               {{0, -8, 2, 50, 52, 49, 48},
                {22, -4, 2, 50, 50, 47, 46},
                {50, -2, 1, 45, 46, 43, 42},
                {90, -3, 1, 41, 41, 39, 39},
                {130, -3, 2, 38, 37, 37, 38},
                {170, -2, 3, 36, 34, 35, 37},
                {205, -1, 3, 34, 32, 34, 35},
                {243.7, 0, 2, 33, 31, 34, 33}},
               45, 25),
          0.010);
  arm.Add(Loft(elbow, wrist, kY, kZ,
               {{0, 0, 2, 33, 31, 34, 33},
                {30, 0, 4, 33, 33, 34, 36},
                {65, 0, 4, 33, 34, 33, 36},
                {105, 0, 3, 31, 31.5, 31, 33},
                {150, 0, 2, 26.5, 26.5, 27.5, 28.5},
                {195, 0, 1, 21.0, 21.0, 25.5, 25.5},
                {239.1, -0.5, 0, 18.0, 17.2, 26.2, 26.2}},
               25, 15),
          0.004);
  // The point of the elbow, and the outer wrist bone.
  arm.Add(Ellipsoid(elbow + Vector3d(-0.002, -0.002, -0.022), {0.020, 0.015, 0.012}), 0.025);
  arm.Add(Ellipsoid(wrist + Vector3d(-0.013, 0.008, -0.018), {0.011, 0.0095, 0.0078}), 0.016);
  return arm;
}

Sculpture MakeLeftLeg() {
  const Vector3d hip = JointAt("left_hip");
  const Vector3d knee = JointAt("left_knee");
  const Vector3d ankle = JointAt("left_ankle");
  Sculpture leg(AlignedBox3d(Vector3d(0.0, kSoleY, -0.14), Vector3d(0.22, 0.06, 0.19)), 0.06);
  // u outwards, v forward: at, centre (out, front), half widths inside, outside, back, front.
  leg.Add(Loft(knee, hip, kX, kZ,
               {{0, 2, -3, 52, 49, 50, 47},
                {28, 1, -1, 54, 51, 50, 52},
                {62, -1, 3, 58, 56, 55, 58},
                {118, -3, 6, 68, 66, 67, 68},
                {190, -2, 8, 78, 76, 77, 77},
                {255, 2, 8, 80, 80, 83, 81},
                {305, 0, 5, 80, 77, 82, 81},
                {384, -4, 0, 70, 62, 66, 70}},
               30, 40),
          0.004);
  leg.Add(Loft(ankle, knee, kX, kZ,
               {{-30, 0, 4, 27, 27, 34, 34},
                {0, 0, 2, 29, 28, 37, 34},
                {35, 1, 0, 27.5, 27.5, 35, 30},
                {65, 2, -3, 30, 30, 35, 31},
                {120, 3, -8, 38, 37, 43, 36},
                {190, 4, -15, 47, 45, 53, 44},
                {270, 4, -18, 53, 51, 58, 48},
                {320, 4, -15, 53, 51, 55, 49},
                {360, 3, -9, 52, 50, 51, 47},
                {398, 2, -3, 52, 49, 50, 47}},
               20, 30),
          0.004);
  // Kneecap and ankle bones.
  leg.Add(Ellipsoid(knee + Vector3d(0.0, 0.008, 0.031), {0.026, 0.032, 0.018}), 0.03);
  leg.Add(Ellipsoid(ankle + Vector3d(0.027, -0.002, -0.003), {0.008, 0.015, 0.013}), 0.02);
  leg.Add(Ellipsoid(ankle + Vector3d(-0.027, 0.006, 0.004), {0.008, 0.015, 0.014}), 0.02);

  // The foot from the heel forward, turned out a little: u outwards, v up, both from the sole.
  const Vector3d heel(0.1255, kSoleY, -0.090);
  const Vector3d toe(0.1450, kSoleY, 0.165);
  Sculpture foot;
  foot.Add(Loft(heel, toe, kX, kY,
                {{20, 0, 32, 26, 26, 33, 30, 2.2},
                 {45, 0, 33, 30, 30, 35, 42, 2.2},
                 {75, 1, 33, 32, 31, 35, 50, 2.1},
                 {105, 1, 31, 34, 33, 33, 47, 2.1},
                 {140, 2, 27, 38, 37, 29, 36, 2.2},
                 {175, 1, 22, 44, 43, 24, 25, 2.3},
                 {200, -1, 18, 45, 44, 20, 20, 2.4},
                 {222, -4, 15, 39, 40, 17, 15.5, 2.5},
                 {236, -7, 13, 32, 34, 15, 12.5, 2.4}},
                20, 17),
           0.010);
  // The arch on the inner side.
  foot.Carve(Ellipsoid(heel + Vector3d(-0.036, -0.004, 0.118), {0.026, 0.020, 0.050}), 0.02);
  leg.Add(foot, 0.035);
  // Cut flat at the sole with a rounded edge.
  leg.Carve([](const Vector3d& p) { return p.y() - kSoleY; }, 0.012);
  return leg;
}

}  // namespace holdfast
