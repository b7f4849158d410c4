// SPDX-License-Identifier: MIT
#include "meshes/make/body/body_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>

#include "geometry/error.h"
#include "meshes/make/body/adaptive_remesher.h"
#include "meshes/make/body/half_surface.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

/// Interleaves the bits of a position on a 4 mm grid: neighbours in space get neighbouring numbers,
/// which caches and compressors like.
std::uint64_t MortonCode(const Vector3d& p) {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::uint64_t>(std::lround((p[axis] + 2.0) / 0.004));
    for (int bit = 0; bit < 20; ++bit) code |= (cell >> bit & 1) << (3 * bit + axis);
  }
  return code;
}

/// Order of the left half: midline, then the body, then the hand.
std::vector<int> OrderOfHalf(const TriangleMesh& half, int& num_midline) {
  const double wrist_x = DefaultRestJoints()(0, WristJoint(Side::kLeft));
  std::vector<int> order(half.NumVertices());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int i) {
    const Vector3d p = half.vertices.col(i);
    const int group = p.x() == 0 ? 0 : (p.x() < wrist_x ? 1 : 2);
    return std::make_tuple(group, MortonCode(p), i);
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  num_midline = static_cast<int>((half.vertices.row(0).array() == 0).count());
  if (half.vertices.row(0).minCoeff() < 0) {
    throw Error("mesh of the left half", "a vertex has crossed the plane x = 0",
                "Refine the mesh at the midline.");
  }
  return order;
}

}  // namespace

BodyMesh MeshBody(const BodyShape& shape) {
  constexpr double kGrid = 0.003;
  constexpr int kRounds = 14;
  const Vector3d low(0, -0.90, -0.17), high(0.87, 0.81, 0.20);
  const TriangleMesh dense =
      PolygoniseHalf([&](const Vector3d& p) { return shape(p); }, low, high, kGrid);
  const RemeshTarget target{TargetEdgeLength, [&](const Vector3d& p, bool on_midline) {
                              return shape.Project(p, on_midline);
                            }};
  const TriangleMesh half = Remesh(dense, target, kRounds);

  BodyMesh body;
  const std::vector<int> order = OrderOfHalf(half, body.num_midline);
  body.num_side = static_cast<int>(half.NumVertices()) - body.num_midline;
  const int num_left = body.NumLeftAndMidline();
  std::vector<int> place(order.size());
  body.mesh.vertices.resize(3, num_left + body.num_side);
  for (int i = 0; i < num_left; ++i) {
    place[order[i]] = i;
    const Vector3d p = half.vertices.col(order[i]).cast<float>().cast<double>();
    body.mesh.vertices.col(i) = p;
    body.mesh.vertices.col(body.MirrorVertex(i)) = Vector3d(-p.x(), p.y(), p.z());
  }
  const Eigen::Index num_faces = half.NumFaces();
  body.mesh.faces.resize(3, 2 * num_faces);
  for (Eigen::Index f = 0; f < num_faces; ++f) {
    const Eigen::Vector3i face(place[half.faces(0, f)], place[half.faces(1, f)],
                               place[half.faces(2, f)]);
    body.mesh.faces.col(f) = face;
    body.mesh.faces.col(num_faces + f) << body.MirrorVertex(face[0]), body.MirrorVertex(face[2]),
        body.MirrorVertex(face[1]);
  }
  return body;
}

std::vector<std::vector<int>> VertexNeighbours(const TriangleMesh& mesh) {
  std::vector<std::vector<int>> neighbours(mesh.NumVertices());
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      // Every edge lies in two faces that run through it in opposite directions.
      neighbours[mesh.faces(corner, f)].push_back(mesh.faces((corner + 1) % 3, f));
    }
  }
  for (auto& ring : neighbours) std::sort(ring.begin(), ring.end());
  return neighbours;
}

std::vector<int> HandVertices(const BodyMesh& body, Side side) {
  const double wrist_x = DefaultRestJoints()(0, WristJoint(Side::kLeft));
  const double sign = side == Side::kLeft ? 1.0 : -1.0;
  std::vector<int> ids;
  for (int i = 0; i < body.mesh.NumVertices(); ++i) {
    if (sign * body.mesh.vertices(0, i) >= wrist_x) ids.push_back(i);
  }
  return ids;
}

}  // namespace holdfast
