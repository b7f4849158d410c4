// SPDX-License-Identifier: MIT
#include "meshes/make/body/body_shape.h"

namespace holdfast {
namespace {

using Eigen::AlignedBox3d;
using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

}  // namespace

Sculpture MakeTrunk() {
  Sculpture trunk(AlignedBox3d(Vector3d(-0.25, -0.2, -0.2), Vector3d(0.25, 0.62, 0.2)), 0.06);
  // u to the left, v forward: at (height), centre, half widths right, left, back, front.
  trunk.Add(Loft(Vector3d::Zero(), kY, kX, kZ,
                 {{-85, 0, 0, 128, 128, 78, 68},
                  {-50, 0, -2, 164, 164, 94, 87, 2.1},
                  {0, 0, -3, 171, 171, 100, 95, 2.2},
                  {45, 0, 0, 159, 159, 94, 98, 2.2},
                  {90, 0, 6, 143, 143, 84, 92, 2.2},
                  {135, 0, 11, 128, 128, 77, 84, 2.2},
                  {180, 0, 13, 121, 121, 77, 79, 2.2},
                  {230, 0, 12, 126, 126, 84, 85, 2.2},
                  {285, 0, 10, 139, 139, 93, 94, 2.3},
                  {345, 0, 5, 151, 151, 100, 102, 2.3},
                  {395, 0, 0, 148, 148, 97, 90, 2.3},
                  {440, 0, -8, 126, 126, 85, 66, 2.2},
                  {475, 0, -13, 92, 92, 68, 50, 2.1},
                  {500, 0, -14, 66, 66, 57, 45, 2.0}},
                 55, 30),
            0.01);
  for (const double side : {-1.0, 1.0}) {
    const auto at = [side](double x, double y, double z) { return Vector3d(side * x, y, z); };
    // Shoulder girdle along the collar bone, and the slope from the neck to the shoulder.
    trunk.Add(
        Loft(
            at(0.030, 0.452, -0.006), at(0.160, 0.446, -0.004), kY, kZ,
            {{0, -4, 0, 55, 40, 66, 58}, {70, -4, 0, 58, 42, 60, 54}, {130, -6, 2, 52, 47, 52, 50}},
            40, 40),
        0.045);
    trunk.Add(
        Loft(
            at(0.022, 0.535, -0.016), at(0.135, 0.478, -0.010), kY, kZ,
            {{0, -8, 0, 40, 20, 34, 30}, {60, -8, 0, 36, 14, 34, 28}, {120, -8, 0, 30, 12, 30, 26}},
            25, 25),
        0.040);
    // Chest, shoulder blades, buttocks, the sides of the hips.
    trunk.Add(Ellipsoid(at(0.068, 0.358, 0.066), {0.070, 0.060, 0.047}), 0.050);
    trunk.Add(Ellipsoid(at(0.075, 0.375, -0.062), {0.055, 0.075, 0.036},
                        AngleAxisd(side * 0.25, kZ).toRotationMatrix()),
              0.05);
    trunk.Add(Ellipsoid(at(0.120, -0.060, -0.004), {0.0565, 0.105, 0.062}), 0.040);
    trunk.Add(Ellipsoid(at(0.076, -0.050, -0.056), {0.078, 0.092, 0.066}), 0.060);
  }
  // The furrow of the spine.
  trunk.Carve(Ellipsoid(Vector3d(0, 0.27, -0.128), {0.016, 0.20, 0.050}), 0.045);
  // Neck: leans forward on its way up.
  trunk.Add(Loft(Vector3d(0, 0.470, -0.016), Vector3d(0, 0.620, 0.014), kX, kZ,
                 {{0, 0, 0, 68, 68, 58, 54},
                  {35, 0, 0, 60, 60, 56, 54},
                  {70, 0, 0, 56, 56, 55, 54},
                  {110, 0, 0, 54, 54, 55, 55},
                  {150, 0, 0, 55, 55, 56, 50}},
                 20, 20),
            0.045);
  return trunk;
}

Sculpture MakeHead() {
  Sculpture head(AlignedBox3d(Vector3d(-0.11, 0.54, -0.11), Vector3d(0.11, 0.80, 0.16)), 0.05);
  // Skull: vault and back of the head.
  head.Add(Ellipsoid(Vector3d(0, 0.694, 0.020), {0.0735, 0.090, 0.095}), 0.01);
  // Face from chin to forehead: at (height), centre, half widths right, left, back, front.
  head.Add(Loft(Vector3d(0, 0.560, 0), Vector3d(0, 0.740, 0), kX, kZ,
                {{11, 0, 74, 26, 26, 26, 33, 2.3},
                 {24, 0, 66, 38, 38, 34, 44, 2.4},
                 {48, 0, 54, 51, 51, 46, 57, 2.5},
                 {80, 0, 42, 61, 61, 55, 68, 2.5},
                 {112, 0, 36, 66, 66, 60, 73, 2.4},
                 {140, 0, 32, 68, 68, 62, 78, 2.2},
                 {165, 0, 28, 62, 62, 60, 76, 2.1}},
                12, 40),
           0.030);
  for (const double side : {-1.0, 1.0}) {
    const auto at = [side](double x, double y, double z) { return Vector3d(side * x, y, z); };
    // Jaw angle, cheek, cheekbone, brow.
    head.Add(Ellipsoid(at(0.045, 0.613, 0.040), {0.014, 0.022, 0.026}), 0.035);
    head.Add(Ellipsoid(at(0.042, 0.630, 0.070), {0.016, 0.024, 0.022}), 0.030);
    head.Add(Ellipsoid(at(0.045, 0.654, 0.078), {0.019, 0.013, 0.020}), 0.030);
    head.Add(Ellipsoid(at(0.026, 0.698, 0.0985), {0.025, 0.0095, 0.0115},
                       AngleAxisd(side * -0.16, kZ).toRotationMatrix()),
             0.022);
    // Eye: a hollow with the lids' mound in it.
    head.Carve(Ellipsoid(at(0.031, 0.677, 0.125), {0.021, 0.0120, 0.018}), 0.018);
    head.Add(Ellipsoid(at(0.031, 0.6755, 0.093), {0.0160, 0.0115, 0.0155}), 0.010);
    // Ear: a leaning shell.
    const Matrix3d lean = (AngleAxisd(side * 0.34, kY) * AngleAxisd(-0.16, kX)).toRotationMatrix();
    head.Add(Ellipsoid(at(0.0750, 0.669, 0.008), {0.0080, 0.0295, 0.0175}, lean), 0.010);
  }
  // Nose: bridge to tip, then the wings.
  head.Add(
      Loft(Vector3d(0, 0.690, 0.102), Vector3d(0, 0.646, 0.124), kX, kZ,
           {{0, 0, 0, 8, 8, 10, 8}, {25, 0, 0, 9, 9, 12, 8.5}, {47, 0, 0, 9.5, 9.5, 12, 10}}, 8, 9),
      0.016);
  head.Add(Ellipsoid(Vector3d(0, 0.6435, 0.114), {0.0148, 0.0082, 0.012}), 0.010);
  // Mouth: one calm mound from nose to lower lip, as on a shop-window figure; chin.
  head.Add(Ellipsoid(Vector3d(0, 0.6270, 0.1010), {0.018, 0.0140, 0.0120}), 0.024);
  head.Add(Ellipsoid(Vector3d(0, 0.6110, 0.1035), {0.024, 0.0115, 0.0140}), 0.014);
  head.Add(Ellipsoid(Vector3d(0, 0.5810, 0.0960), {0.022, 0.0140, 0.0160}), 0.030);
  return head;
}

}  // namespace holdfast
