// SPDX-License-Identifier: MIT
#include "generator/actions/object_marks.h"

#include <algorithm>
#include <array>

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kRimBand_m = 0.003;

// Where the tip is on the bounding box, per axis -1 to 1, and where it and the working side point.
struct Known {
  std::string_view name;
  Vector3d tip, forward, facing;
  bool round;
};

const std::array<Known, 18>& AllKnown() {
  static const std::array<Known, 18> known = {{
      {"apple", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}, true},
      {"banana", {1, 0, 0.4}, {1, 0, 0}, {0, 0, 1}, false},
      {"bottle", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, true},
      {"bowl", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, true},
      {"camera", {0, -1, 0}, {0, -1, 0}, {0, 0, 1}, false},
      {"cube", {0, 0, 0}, {1, 0, 0}, {0, 0, 1}, false},
      {"cylinder", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, true},
      {"flashlight", {1, 0, 0}, {1, 0, 0}, {0, 0, 1}, false},
      {"fryingpan", {-0.5, 0, 0}, {-1, 0, 0}, {0, 0, 1}, false},
      {"hammer", {0.9, 1, 0}, {1, 0, 0}, {0, 1, 0}, false},
      {"knife", {0.6, -1, 0}, {1, 0, 0}, {0, -1, 0}, false},
      {"lightbulb", {0, 0, -1}, {0, 0, -1}, {1, 0, 0}, true},
      {"mug", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, true},
      {"phone", {0, 0.85, -1}, {0, 1, 0}, {0, 0, -1}, false},
      {"sphere", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}, true},
      {"teapot", {1, 0, 0.4}, {1, 0, 0}, {0, 0, 1}, false},
      {"toothbrush", {0.9, 0, 1}, {1, 0, 0}, {0, 0, 1}, false},
      {"wineglass", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, true},
  }};
  return known;
}

}  // namespace

ObjectMarks MarksOf(std::string_view name, const TriangleMesh& mesh) {
  ObjectMarks marks;
  const Vector3d low = mesh.vertices.rowwise().minCoeff();
  const Vector3d high = mesh.vertices.rowwise().maxCoeff();
  marks.middle = 0.5 * (low + high);
  marks.size = high - low;

  // The rim: the ring of vertices within 3 mm of the top.
  Vector3d rim_low = high, rim_high = low;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i) {
    const Vector3d p = mesh.vertices.col(i);
    if (p.z() < high.z() - kRimBand_m) continue;
    rim_low = rim_low.cwiseMin(p);
    rim_high = rim_high.cwiseMax(p);
  }
  marks.rim = 0.5 * (rim_low + rim_high);
  marks.rim.z() = high.z();
  marks.rim_radius = 0.25 * (rim_high - rim_low).head<2>().sum();

  marks.tip = marks.middle;
  for (const Known& known : AllKnown()) {
    if (known.name != name) continue;
    marks.tip = marks.middle + 0.5 * marks.size.cwiseProduct(known.tip);
    marks.forward = known.forward;
    marks.facing = known.facing;
    marks.round = known.round;
    marks.two_sided = name == "hammer";
  }
  return marks;
}

Eigen::Isometry3d TurnedOver() {
  Eigen::Isometry3d turned = Eigen::Isometry3d::Identity();
  turned.linear() = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  return turned;
}

TriangleMesh ReflectX(const TriangleMesh& mesh) {
  TriangleMesh reflected = mesh;
  reflected.vertices.row(0) *= -1.0;
  reflected.faces.row(1).swap(reflected.faces.row(2));
  return reflected;
}

ObjectMarks ReflectX(const ObjectMarks& marks) {
  ObjectMarks reflected = marks;
  for (Vector3d* v :
       {&reflected.middle, &reflected.rim, &reflected.tip, &reflected.forward, &reflected.facing}) {
    v->x() *= -1.0;
  }
  return reflected;
}

}  // namespace holdfast
