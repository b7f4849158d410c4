// SPDX-License-Identifier: MIT
#include "generator/actions/face_marks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/score/contact_metrics.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kMidline_m = 0.012, kEarBand_m = 0.02;

double WeightOf(const BodySurface& body, int vertex, std::initializer_list<int> joints) {
  double sum = 0.0;
  for (const auto& [joint, weight] : body.Weights(vertex)) {
    for (const int wanted : joints) sum += joint == wanted ? weight : 0.0;
  }
  return sum;
}

// Skin moved by the head, and by the upper part of the neck, in the head frame.
TriangleMesh HeadOf(const BodySurface& body) {
  const Vector3d origin = body.RestJoints().col(kHead);
  std::vector<int> place(static_cast<std::size_t>(body.NumVertices()), -1);
  std::vector<Vector3d> points;
  for (int i = 0; i < body.NumVertices(); ++i) {
    if (WeightOf(body, i, {kHead, kJaw, kLeftEye, kRightEye, kNeck}) < 0.5) continue;
    if (WeightOf(body, i, {kHead, kJaw, kLeftEye, kRightEye}) < 0.2) continue;
    place[static_cast<std::size_t>(i)] = static_cast<int>(points.size());
    points.push_back(body.RestVertices().col(i) - origin);
  }
  std::vector<Eigen::Vector3i> faces;
  for (Eigen::Index f = 0; f < body.Faces().cols(); ++f) {
    Eigen::Vector3i face;
    for (int c = 0; c < 3; ++c) face(c) = place[static_cast<std::size_t>(body.Faces()(c, f))];
    if ((face.array() >= 0).all()) faces.push_back(face);
  }
  TriangleMesh head;
  head.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) head.vertices.col(i) = points[i];
  head.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f) head.faces.col(f) = faces[f];
  return head;
}

// Returns the foremost midline point of the skin in a range of heights.
Vector3d Foremost(const Eigen::Matrix3Xd& skin, double lowest, double highest) {
  Vector3d best(0.0, 0.0, -1.0);
  for (Eigen::Index i = 0; i < skin.cols(); ++i) {
    const Vector3d p = skin.col(i);
    if (std::abs(p.x()) > kMidline_m || p.y() < lowest || p.y() > highest) continue;
    if (p.z() > best.z()) best = p;
  }
  return best;
}

}  // namespace

FaceMarks FindFaceMarks(const BodySurface& body) {
  FaceMarks marks;
  const TriangleMesh open = HeadOf(body);
  const Eigen::Matrix3Xd& joints = body.RestJoints();
  marks.eyes = 0.5 * (joints.col(kLeftEye) + joints.col(kRightEye)) - joints.col(kHead);
  const Vector3d nose = Foremost(open.vertices, 0.0, marks.eyes.y() - 0.01);
  if (open.faces.cols() == 0 || nose.z() < 0.0 || marks.eyes.y() <= nose.y()) {
    throw Error("body model", "has no head with a recognizable face",
                "Use a whole body whose eyes (joints 23, 24) are above its nose");
  }
  const double mouth = nose.y() - 1.2 * (marks.eyes.y() - nose.y());
  marks.mouth = Foremost(open.vertices, mouth - 0.006, mouth + 0.006);
  marks.mouth.x() = 0.0;
  marks.right_ear = Vector3d::Zero();
  for (Eigen::Index i = 0; i < open.vertices.cols(); ++i) {
    const Vector3d p = open.vertices.col(i);
    if (p.y() > marks.eyes.y() || p.y() < marks.eyes.y() - kEarBand_m) continue;
    if (p.x() < marks.right_ear.x()) marks.right_ear = p;
  }
  marks.head = CloseHoles(open);
  return marks;
}

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kOffSkin_m = 0.003;
constexpr double kNearLens_m = 0.13, kFarLens_m = 0.2, kNearScreen_m = 0.26, kFarScreen_m = 0.38;

// Returns the rim point nearest to a place; the rim is a circle around the object's z axis.
Vector3d RimTowards(const ObjectMarks& object, const Vector3d& place) {
  Vector3d out = place - object.rim;
  out.z() = 0.0;
  if (out.squaredNorm() < 1e-12) return object.rim;
  return object.rim + object.rim_radius * out.normalized();
}

}  // namespace

std::optional<FacePlace> FacePlaceOf(std::string_view action, const ObjectMarks& object,
                                     const FaceMarks& face, const Isometry3d& head_from_object) {
  const Vector3d mouth = face.mouth + Vector3d(0.0, 0.0, kOffSkin_m);
  if (action == "drink" || action == "toast") {
    const Vector3d lips = mouth + Vector3d(0.0, -0.004, 0.0);
    return FacePlace{RimTowards(object, head_from_object.inverse() * lips), lips};
  }
  if (action == "eat") {
    if (object.size.x() > 2.0 * object.size.y()) return FacePlace{object.tip, mouth};
    const Vector3d in_object = head_from_object.inverse() * mouth;
    const Vector3d out = (in_object - object.middle).normalized();
    return FacePlace{object.middle + 0.5 * object.size.head<2>().maxCoeff() * out, mouth};
  }
  if (action == "call") {
    return FacePlace{object.tip, face.right_ear + Vector3d(-0.006, -0.004, 0.004)};
  }
  if (action == "takepicture") {
    const bool flat = object.size.z() < 0.3 * object.size.x();
    Vector3d place = face.eyes + Vector3d(0.0, -0.02, 0.0);
    place.z() = std::clamp((head_from_object * object.middle).z(),
                           face.eyes.z() + (flat ? kNearScreen_m : kNearLens_m),
                           face.eyes.z() + (flat ? kFarScreen_m : kFarLens_m));
    return FacePlace{object.middle, place};
  }
  if (action == "brush") return FacePlace{object.tip, mouth};
  return std::nullopt;
}

namespace {

using Eigen::Vector3d;

constexpr double kRimBand_m = 0.003;

// Tip on the bounding box (-1 to 1 per axis), and directions of the tip and the working side.
struct Known {
  std::string_view name;
  Vector3d tip, forward, facing;
};

const std::array<Known, 18>& AllKnown() {
  static const std::array<Known, 18> known = {{
      {"apple", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}},
      {"banana", {1, 0, 0.4}, {1, 0, 0}, {0, 0, 1}},
      {"bottle", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}},
      {"bowl", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}},
      {"camera", {0, -1, 0}, {0, -1, 0}, {0, 0, 1}},
      {"cube", {0, 0, 0}, {1, 0, 0}, {0, 0, 1}},
      {"cylinder", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}},
      {"flashlight", {1, 0, 0}, {1, 0, 0}, {0, 0, 1}},
      {"fryingpan", {-0.5, 0, 0}, {-1, 0, 0}, {0, 0, 1}},
      {"hammer", {0.9, 1, 0}, {1, 0, 0}, {0, 1, 0}},
      {"knife", {0.6, -1, 0}, {1, 0, 0}, {0, -1, 0}},
      {"lightbulb", {0, 0, -1}, {0, 0, -1}, {1, 0, 0}},
      {"mug", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}},
      {"phone", {0, 0.85, -1}, {0, 1, 0}, {0, 0, -1}},
      {"sphere", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}},
      {"teapot", {1, 0, 0.4}, {1, 0, 0}, {0, 0, 1}},
      {"toothbrush", {0.9, 0, 1}, {1, 0, 0}, {0, 0, 1}},
      {"wineglass", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}},
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

  // Rim: the ring of vertices within 3 mm of the top.
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
