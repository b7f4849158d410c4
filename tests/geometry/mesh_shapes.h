// SPDX-License-Identifier: MIT
#pragma once

// Shapes with known answers, for the tests of geometry/.

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"

namespace holdfast::testing {

/// A box with corners `low` and `high`: 8 vertices, 12 faces, outwards.
inline TriangleMesh Box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 8);
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.col(i) << (i & 1 ? high : low).x(), (i & 2 ? high : low).y(),
        (i & 4 ? high : low).z();
  }
  mesh.faces.resize(3, 12);
  mesh.faces << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,            //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return mesh;
}

/// Signed distance to a box, exact.
inline double BoxDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& low,
                          const Eigen::Vector3d& high) {
  const Eigen::Vector3d q = (p - 0.5 * (low + high)).cwiseAbs() - 0.5 * (high - low);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

/// A sphere around the origin: an octahedron's faces halved `levels` times; outwards.
inline TriangleMesh Sphere(double radius, int levels) {
  std::vector<Eigen::Vector3d> vertices = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                           {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  std::vector<Eigen::Vector3i> faces = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                        {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto between = [&](int a, int b) {
      const auto [entry, is_new] =
          middle.try_emplace(std::minmax(a, b), static_cast<int>(vertices.size()));
      if (is_new) vertices.push_back((vertices[a] + vertices[b]).normalized());
      return entry->second;
    };
    std::vector<Eigen::Vector3i> finer;
    for (const Eigen::Vector3i& f : faces) {
      const int ab = between(f[0], f[1]);
      const int bc = between(f[1], f[2]);
      const int ca = between(f[2], f[0]);
      finer.insert(finer.end(), {{f[0], ab, ca}, {ab, f[1], bc}, {ca, bc, f[2]}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  mesh.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i) mesh.vertices.col(i) = radius * vertices[i];
  for (std::size_t i = 0; i < faces.size(); ++i) mesh.faces.col(i) = faces[i];
  return mesh;
}

/// Two cones on one unit circle of `sectors` corners, tips at z = 1 and -1 (vertices 0 and 1).
inline TriangleMesh DoubleCone(int sectors) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, sectors + 2);
  mesh.vertices.col(0) << 0, 0, 1;
  mesh.vertices.col(1) << 0, 0, -1;
  mesh.faces.resize(3, 2 * sectors);
  for (int i = 0; i < sectors; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / sectors;
    mesh.vertices.col(2 + i) << std::cos(angle), std::sin(angle), 0;
    const int next = (i + 1) % sectors;
    mesh.faces.col(2 * i) << 0, 2 + i, 2 + next;
    mesh.faces.col(2 * i + 1) << 1, 2 + next, 2 + i;
  }
  return mesh;
}

/// A torus around the z axis, closed, genus one, outwards.
inline TriangleMesh Torus(double major, double minor, int around, int across) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, around * across);
  mesh.faces.resize(3, 2 * around * across);
  const double turn = 2.0 * std::numbers::pi;
  Eigen::Index face = 0;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double u = turn * i / around;
      const double v = turn * j / across;
      const double r = major + minor * std::cos(v);
      mesh.vertices.col(i * across + j) << r * std::cos(u), r * std::sin(u), minor * std::sin(v);
      const int a = i * across + j;
      const int b = (i + 1) % around * across + j;
      const int c = (i + 1) % around * across + (j + 1) % across;
      const int d = i * across + (j + 1) % across;
      mesh.faces.col(face++) << a, b, c;
      mesh.faces.col(face++) << a, c, d;
    }
  }
  return mesh;
}

/// A flat n x n grid of squares of edge `step` in the plane z = 0, facing +z: a surface with
/// boundary.
inline TriangleMesh Sheet(int n, double step) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, (n + 1) * (n + 1));
  mesh.faces.resize(3, 2 * n * n);
  Eigen::Index face = 0;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) {
      const int a = y * (n + 1) + x;
      mesh.vertices.col(a) << step * x, step * y, 0.0;
      if (x == n || y == n) continue;
      mesh.faces.col(face++) << a, a + 1, a + n + 2;
      mesh.faces.col(face++) << a, a + n + 2, a + n + 1;
    }
  }
  return mesh;
}

/// Both meshes as one, without joining them.
inline TriangleMesh Together(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, a.NumVertices() + b.NumVertices());
  mesh.vertices << a.vertices, b.vertices;
  mesh.faces.resize(3, a.NumFaces() + b.NumFaces());
  mesh.faces << a.faces, (b.faces.array() + static_cast<int>(a.NumVertices())).matrix();
  return mesh;
}

/// `mesh` with one face more.
inline TriangleMesh WithFace(TriangleMesh mesh, int a, int b, int c) {
  mesh.faces.conservativeResize(Eigen::NoChange, mesh.NumFaces() + 1);
  mesh.faces.rightCols<1>() << a, b, c;
  return mesh;
}

/// `mesh` with one vertex more, of no face.
inline TriangleMesh WithVertex(TriangleMesh mesh, const Eigen::Vector3d& p) {
  mesh.vertices.conservativeResize(Eigen::NoChange, mesh.NumVertices() + 1);
  mesh.vertices.rightCols<1>() = p;
  return mesh;
}

/// Every triangle with corners of its own, as an .stl file has them.
inline TriangleMesh Exploded(const TriangleMesh& mesh) {
  TriangleMesh loose;
  loose.vertices.resize(3, 3 * mesh.NumFaces());
  loose.faces.resize(3, mesh.NumFaces());
  for (int i = 0; i < 3 * mesh.NumFaces(); ++i) {
    loose.vertices.col(i) = mesh.vertices.col(mesh.faces(i % 3, i / 3));
    loose.faces(i % 3, i / 3) = i;
  }
  return loose;
}

/// The same surface with its inside out.
inline TriangleMesh InsideOut(TriangleMesh mesh) {
  mesh.faces.row(1).swap(mesh.faces.row(2));
  return mesh;
}

}  // namespace holdfast::testing
