// SPDX-License-Identifier: MIT
#include "apps/motion/reach_markers.h"

#include <cmath>
#include <numbers>

namespace holdfast::apps {

TriangleMesh GoalMarkers(std::span<const Eigen::Vector3d> goals) {
  constexpr double kMarkerRadius = 0.04;  // metres
  constexpr int kAround = 12, kRings = 7;
  constexpr int kVertices = kAround * kRings + 2, kFaces = 2 * kAround * kRings;
  const auto count = static_cast<Eigen::Index>(goals.size());
  TriangleMesh mesh;
  mesh.vertices.resize(3, kVertices * count);
  mesh.faces.resize(3, kFaces * count);
  for (Eigen::Index g = 0; g < count; ++g) {
    const Eigen::Vector3d& centre = goals[static_cast<std::size_t>(g)];
    const auto first = static_cast<int>(kVertices * g);
    int face = static_cast<int>(kFaces * g);
    for (int r = 0; r < kRings; ++r) {
      const double polar = std::numbers::pi * (r + 1) / (kRings + 1);
      for (int a = 0; a < kAround; ++a) {
        const double azimuth = 2.0 * std::numbers::pi * a / kAround;
        mesh.vertices.col(first + kAround * r + a) =
            centre + kMarkerRadius * Eigen::Vector3d(std::sin(polar) * std::cos(azimuth),
                                                     std::sin(polar) * std::sin(azimuth),
                                                     std::cos(polar));
        const int here = first + kAround * r + a, next = first + kAround * r + (a + 1) % kAround;
        if (r + 1 == kRings) continue;
        mesh.faces.col(face++) << here, here + kAround, next;
        mesh.faces.col(face++) << next, here + kAround, next + kAround;
      }
    }
    const int top = first + kVertices - 2, bottom = first + kVertices - 1;
    mesh.vertices.col(top) = centre + Eigen::Vector3d(0.0, 0.0, kMarkerRadius);
    mesh.vertices.col(bottom) = centre - Eigen::Vector3d(0.0, 0.0, kMarkerRadius);
    for (int a = 0; a < kAround; ++a) {
      const int b = (a + 1) % kAround, ring = first + kAround * (kRings - 1);
      mesh.faces.col(face++) << top, first + a, first + b;
      mesh.faces.col(face++) << bottom, ring + b, ring + a;
    }
  }
  return mesh;
}

}  // namespace holdfast::apps
