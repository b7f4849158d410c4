// SPDX-License-Identifier: MIT
#include "generator/actions/face_marks.h"

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

// The skin that the head moves, with the neck's upper part, in the head's frame.
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

// The foremost skin on the midline near a height.
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
    throw Error("body model", "has no head with a face that actions could be brought to",
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

}  // namespace holdfast
