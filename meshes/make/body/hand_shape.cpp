// SPDX-License-Identifier: MIT
#include <algorithm>

#include "meshes/make/body/body_shape.h"
#include "meshes/make/body/hand_mean.h"

namespace holdfast {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Half widths of a finger, millimetres, at base, first joint, second joint and near the tip:
/// sideways, towards the back of the hand and towards the palm.
struct FingerGirth {
  std::array<double, 4> side, dorsal, palmar;
};

const std::array<FingerGirth, kNumFingers> kGirth = {{
    {{9.0, 8.3, 7.3, 5.6}, {8.4, 7.6, 6.3, 3.9}, {9.2, 8.0, 7.2, 5.6}},
    {{9.1, 8.4, 7.4, 5.7}, {8.6, 7.8, 6.4, 4.0}, {9.4, 8.2, 7.3, 5.7}},
    {{7.6, 6.9, 6.1, 4.8}, {7.0, 6.3, 5.3, 3.4}, {7.8, 6.8, 6.1, 4.8}},
    {{8.6, 7.8, 6.9, 5.3}, {8.1, 7.2, 6.0, 3.8}, {8.9, 7.7, 6.9, 5.4}},
    {{11.0, 9.6, 9.3, 6.8}, {10.5, 8.6, 7.4, 4.4}, {11.5, 9.2, 8.2, 6.2}},
}};

Sculpture MakeFinger(Finger finger) {
  const FingerChain chain = LeftFingerChain(finger);
  const FingerGirth& girth = kGirth[finger];
  AlignedBox3d box;
  for (const Vector3d& p : chain.points) box.extend(p);
  box.min().array() -= 0.012;
  box.max().array() += 0.012;
  Sculpture shape(box, 0.02);
  const Vector3d dorsal = LeftDorsalDirection(finger);
  for (int k = 0; k < 3; ++k) {
    const Vector3d& begin = chain.points[k];
    const Vector3d& end = chain.points[k + 1];
    const double length = 1e3 * (end - begin).norm();
    const double s0 = girth.side[k], d0 = girth.dorsal[k], p0 = girth.palmar[k];
    const double s1 = girth.side[k + 1], d1 = girth.dorsal[k + 1], p1 = girth.palmar[k + 1];
    std::vector<Section> sections;
    double end_cap = 0.7 * s1;
    if (k < 2) {
      // A phalanx is slimmest past its middle; its pad swells on the palm side.
      sections = {{0, 0, 0, s0, s0, d0, p0},
                  {0.5 * length, 0, 0, 0.490 * (s0 + s1), 0.490 * (s0 + s1), 0.48 * (d0 + d1),
                   0.51 * (p0 + p1)},
                  {length, 0, 0, s1, s1, d1, p1}};
    } else {
      // The last one ends in the rounded pad, `end_cap` short of the tip.
      end_cap = 1.05 * s1;
      const double body = length - end_cap;
      sections = {{0, 0, 0, s0, s0, d0, p0},
                  {0.55 * body, 0, 0, 0.97 * s0, 0.97 * s0, 0.85 * d0, 1.0 * p0},
                  {body, 0, 0, 0.86 * s0, 0.86 * s0, d1, p1}};
    }
    // v runs from the back to the palm side: v_minus is dorsal.
    shape.Add(Loft(begin, end, dorsal.cross(end - begin), -dorsal, sections, 0.7 * s0, end_cap),
              0.003);
  }
  return shape;
}

/// Palm in the frame of the wrist: x to the fingers, y to the back of the hand, z to the thumb.
Sculpture MakePalm(const Vector3d& wrist) {
  AlignedBox3d box(wrist + Vector3d(-0.03, -0.035, -0.055), wrist + Vector3d(0.105, 0.03, 0.075));
  Sculpture palm(box, 0.03);
  // at, centre (z, y), half widths: little finger side, thumb side, palm, back.
  palm.Add(Loft(wrist, wrist + Vector3d::UnitX(), Vector3d::UnitZ(), Vector3d::UnitY(),
                {{-22, 0.0, -0.5, 26.0, 26.0, 18.5, 18.0, 2.0},
                 {0, 0.0, -0.5, 26.5, 26.5, 18.0, 17.0, 2.1},
                 {22, 0.0, -1.0, 31.5, 29.0, 16.0, 15.5, 2.3},
                 {45, -2.0, -1.5, 36.5, 33.0, 13.5, 14.0, 2.5},
                 {65, -4.0, -2.0, 38.0, 35.5, 12.0, 12.5, 2.6},
                 {80, -4.5, -2.5, 37.0, 36.0, 11.5, 11.0, 2.6},
                 {90, -4.0, -3.0, 33.0, 33.5, 10.0, 9.0, 2.4}},
                15, 8),
           0.002);
  // The heel of the hand on the little finger side.
  palm.Add(Ellipsoid(wrist + Vector3d(0.040, -0.0100, -0.0235), {0.034, 0.0105, 0.0135}), 0.020);
  // Pads under the knuckles.
  palm.Add(Ellipsoid(wrist + Vector3d(0.078, -0.0105, -0.003), {0.012, 0.0065, 0.034}), 0.010);
  // Knuckles.
  for (const Finger finger : {kIndex, kMiddle, kRing, kPinky}) {
    const Vector3d joint = LeftFingerChain(finger).points[0];
    const double size = kGirth[finger].side[0] / 9.0;
    palm.Add(
        Ellipsoid(joint + Vector3d(-0.001, 0.0045, 0.0), size * Vector3d(0.0105, 0.0072, 0.0082)),
        0.010);
  }
  // The ball of the thumb along its metacarpal, and the web to the index.
  const FingerChain thumb = LeftFingerChain(kThumb);
  const Vector3d dorsal = LeftDorsalDirection(kThumb);
  palm.Add(Loft(thumb.points[0], thumb.points[1], dorsal.cross(thumb.points[1] - thumb.points[0]),
                -dorsal,
                {{-8, 0, 0, 12, 12, 11, 12},
                 {14, 0, 2, 13.5, 13.5, 11, 14},
                 {30, 0, 1, 12.5, 12.0, 10.5, 12.5},
                 {43, 0, 0, 11.0, 11.0, 10.0, 11.0}},
                9, 6),
           0.014);
  palm.Add(Ellipsoid(wrist + Vector3d(0.0420, -0.0100, 0.0270), {0.0165, 0.0080, 0.0110},
                     Eigen::AngleAxisd(-0.75, Vector3d::UnitY()).toRotationMatrix()),
           0.020);
  // The hollow of the palm.
  palm.Carve(Ellipsoid(wrist + Vector3d(0.052, -0.0315, -0.006), {0.026, 0.0175, 0.014}), 0.012);
  return palm;
}

}  // namespace

HandShape MakeLeftHand() {
  HandShape hand;
  hand.palm = MakePalm(DefaultRestJoints().col(WristJoint(Side::kLeft)));
  for (int f = 0; f < kNumFingers; ++f) hand.fingers[f] = MakeFinger(static_cast<Finger>(f));
  return hand;
}

double HandShape::operator()(const Vector3d& point) const {
  double finger_value = 1e3;
  for (const Sculpture& finger : fingers) finger_value = std::min(finger_value, finger(point));
  return SmoothUnion(palm(point), finger_value, 0.007);
}

}  // namespace holdfast
