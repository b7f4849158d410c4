// SPDX-License-Identifier: MIT
#include "meshes/make/body/half_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

using Eigen::Vector3d;

/// Kuhn's six tetrahedra of a cube, corners as bits x + 2y + 4z: the same on every cube, so
/// neighbours share their diagonals.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

class HalfPolygoniser {
 public:
  HalfPolygoniser(const std::function<double(const Vector3d&)>& value, const Vector3d& low,
                  const Vector3d& high, double spacing)
      : value_(value), low_(low), spacing_(spacing) {
    for (int axis = 0; axis < 3; ++axis) {
      blocks_[axis] = static_cast<int>(std::ceil((high - low)[axis] / (kBlock * spacing)));
    }
  }

  TriangleMesh Run() {
    for (int x = 0; x < blocks_[0]; ++x) {
      for (int y = 0; y < blocks_[1]; ++y) {
        for (int z = 0; z < blocks_[2]; ++z) VisitBlock({x, y, z});
      }
    }
    TriangleMesh mesh;
    mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices_.size()));
    mesh.faces.resize(3, static_cast<Eigen::Index>(faces_.size()));
    for (std::size_t i = 0; i < vertices_.size(); ++i) mesh.vertices.col(i) = vertices_[i];
    for (std::size_t i = 0; i < faces_.size(); ++i) mesh.faces.col(i) = faces_[i];
    return mesh;
  }

 private:
  static constexpr int kBlock = 8;

  void VisitBlock(const Eigen::Vector3i& block) {
    const double half_diagonal = 0.5 * std::sqrt(3.0) * kBlock * spacing_;
    const Vector3d centre =
        low_ + kBlock * spacing_ * (block.cast<double>() + Vector3d::Constant(0.5));
    if (std::abs(value_(centre)) > 3 * half_diagonal) return;
    for (int x = 0; x < kBlock; ++x) {
      for (int y = 0; y < kBlock; ++y) {
        for (int z = 0; z < kBlock; ++z) VisitCell(kBlock * block + Eigen::Vector3i(x, y, z));
      }
    }
  }

  static std::uint64_t Key(const Eigen::Vector3i& node) {
    return static_cast<std::uint64_t>(node.x()) << 40 | static_cast<std::uint64_t>(node.y()) << 20 |
           static_cast<std::uint64_t>(node.z());
  }
  Vector3d Position(const Eigen::Vector3i& node) const {
    return low_ + spacing_ * node.cast<double>();
  }
  double ValueAt(const Eigen::Vector3i& node) {
    const auto [it, fresh] = values_.try_emplace(Key(node), 0.0);
    if (fresh) it->second = value_(Position(node));
    return it->second;
  }

  void VisitCell(const Eigen::Vector3i& cell) {
    std::array<Eigen::Vector3i, 8> nodes;
    std::array<double, 8> values;
    bool any_inside = false, any_outside = false;
    for (int corner = 0; corner < 8; ++corner) {
      nodes[corner] = cell + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      values[corner] = ValueAt(nodes[corner]);
      (values[corner] < 0 ? any_inside : any_outside) = true;
    }
    if (!any_inside || !any_outside) return;
    for (const auto& tetrahedron : kTetrahedra) VisitTetrahedron(nodes, values, tetrahedron);
  }

  void VisitTetrahedron(const std::array<Eigen::Vector3i, 8>& nodes,
                        const std::array<double, 8>& values, const std::array<int, 4>& corners) {
    std::vector<int> in, out;
    for (const int corner : corners) (values[corner] < 0 ? in : out).push_back(corner);
    if (in.empty() || out.empty()) return;
    const auto cut = [&](int a, int b) {
      return CutEdge(nodes[a], values[a], nodes[b], values[b]);
    };
    Vector3d outwards = Vector3d::Zero();
    for (const int a : in) {
      for (const int b : out) outwards += (nodes[b] - nodes[a]).cast<double>();
    }
    if (in.size() == 1) {
      AddFace(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2]), outwards);
    } else if (out.size() == 1) {
      AddFace(cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0]), outwards);
    } else {
      const int a = cut(in[0], out[0]), b = cut(in[0], out[1]);
      const int c = cut(in[1], out[1]), d = cut(in[1], out[0]);
      AddFace(a, b, c, outwards);
      AddFace(a, c, d, outwards);
    }
  }

  int CutEdge(Eigen::Vector3i a, double value_a, Eigen::Vector3i b, double value_b) {
    std::uint64_t key_a = Key(a), key_b = Key(b);
    if (key_a > key_b) {
      std::swap(a, b);
      std::swap(value_a, value_b);
      std::swap(key_a, key_b);
    }
    // The three low bits name the edge's direction: nodes differ by 0 or 1 in each coordinate.
    const Eigen::Vector3i step = b - a;
    const std::uint64_t key =
        key_a << 3 | static_cast<std::uint64_t>(std::abs(step.x()) << 2 | std::abs(step.y()) << 1 |
                                                std::abs(step.z()));
    const auto [it, fresh] = edges_.try_emplace(key, static_cast<int>(vertices_.size()));
    if (fresh) {
      // Kept off the nodes, so that no triangle degenerates to a point.
      const double t = std::clamp(value_a / (value_a - value_b), 0.02, 0.98);
      vertices_.push_back((1 - t) * Position(a) + t * Position(b));
    }
    return it->second;
  }

  void AddFace(int a, int b, int c, const Vector3d& outwards) {
    const Vector3d normal = (vertices_[b] - vertices_[a]).cross(vertices_[c] - vertices_[a]);
    if (normal.dot(outwards) < 0) std::swap(b, c);
    faces_.emplace_back(a, b, c);
  }

  const std::function<double(const Vector3d&)>& value_;
  const Vector3d low_;
  const double spacing_;
  Eigen::Vector3i blocks_;
  std::unordered_map<std::uint64_t, double> values_;
  std::unordered_map<std::uint64_t, int> edges_;
  std::vector<Vector3d> vertices_;
  std::vector<Eigen::Vector3i> faces_;
};

}  // namespace

TriangleMesh PolygoniseHalf(const std::function<double(const Vector3d&)>& value,
                            const Vector3d& low, const Vector3d& high, double spacing) {
  return HalfPolygoniser(value, low, high, spacing).Run();
}

}  // namespace holdfast
