// SPDX-License-Identifier: MIT
#include "meshes/make/objects/implicit_mesher.h"

#include <array>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "meshes/make/objects/remesher.h"

namespace holdfast {
namespace {

using solids::Field;
using solids::Vec3;

/// Field values on the nodes of a regular grid.
class Grid {
 public:
  Grid(const Field& solid, const Vec3& low, const Vec3& high, double cell)
      : low_(low), cell_(cell) {
    for (int k = 0; k < 3; ++k)
      nodes_[k] = static_cast<int>(std::ceil((high[k] - low[k]) / cell)) + 1;
    values_.resize(static_cast<std::size_t>(nodes_[0]) * nodes_[1] * nodes_[2]);
    // A block far from the surface needs one value; a quarter more covers fields that are a little
    // steeper than a distance.
    constexpr int kBlock = 8;
    const double reach = 1.25 * 0.5 * kBlock * cell * std::sqrt(3.0);
    for (int bz = 0; bz < nodes_[2]; bz += kBlock) {
      for (int by = 0; by < nodes_[1]; by += kBlock) {
        for (int bx = 0; bx < nodes_[0]; bx += kBlock) {
          const Vec3 center = low + cell * (Vec3(bx, by, bz) + Vec3::Constant(0.5 * (kBlock - 1)));
          const double at_center = solid(center);
          const bool near = std::abs(at_center) < reach;
          for (int z = bz; z < std::min(bz + kBlock, nodes_[2]); ++z) {
            for (int y = by; y < std::min(by + kBlock, nodes_[1]); ++y) {
              for (int x = bx; x < std::min(bx + kBlock, nodes_[0]); ++x) {
                values_[Index(x, y, z)] =
                    static_cast<float>(near ? solid(Node(x, y, z)) : at_center);
              }
            }
          }
        }
      }
    }
  }

  int Nodes(int axis) const { return nodes_[axis]; }
  std::size_t Index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * nodes_[1] + y) * nodes_[0] + x;
  }
  Vec3 Node(int x, int y, int z) const { return low_ + cell_ * Vec3(x, y, z); }
  bool Inside(int x, int y, int z) const { return values_[Index(x, y, z)] < 0.0F; }

 private:
  Vec3 low_;
  double cell_;
  std::array<int, 3> nodes_{};
  std::vector<float> values_;
};

Vec3 Crossing(const Field& solid, Vec3 inside, Vec3 outside) {
  for (int k = 0; k < 10; ++k) {
    const Vec3 middle = 0.5 * (inside + outside);
    (solid(middle) < 0.0 ? inside : outside) = middle;
  }
  return 0.5 * (inside + outside);
}

/// The tangent planes met on the edges of one cell.
struct CellPlanes {
  Eigen::Matrix3d normal_sum = Eigen::Matrix3d::Zero();
  Vec3 moment = Vec3::Zero();  ///< sum of n (n . x)
  Vec3 point_sum = Vec3::Zero();
  int count = 0;

  void Add(const Vec3& point, const Vec3& normal) {
    normal_sum += normal * normal.transpose();
    moment += normal * normal.dot(point);
    point_sum += point;
    ++count;
  }

  /// Where the planes meet best; directions they leave open stay at the mean of the crossings.
  Vec3 Meet() const {
    const Vec3 mean = point_sum / count;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(normal_sum);
    const Vec3 residual = moment - normal_sum * mean;
    Vec3 step = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      if (eigen.eigenvalues()[k] < 0.08 * eigen.eigenvalues()[2]) continue;
      const Vec3 axis = eigen.eigenvectors().col(k);
      step += axis * (axis.dot(residual) / eigen.eigenvalues()[k]);
    }
    return mean + step;
  }
};

/// Dual contouring: one vertex per cell that the surface crosses, one quad per crossed edge.
TriangleMesh Contour(const Field& solid, const Vec3& low, const Vec3& high, double cell) {
  const Grid grid(solid, low, high, cell);
  std::map<std::size_t, CellPlanes> cells;  // ordered: the numbering must not depend on a hash
  struct Quad {
    std::array<std::size_t, 4> corner;
  };
  std::vector<Quad> quads;
  for (int z = 0; z < grid.Nodes(2); ++z) {
    for (int y = 0; y < grid.Nodes(1); ++y) {
      for (int x = 0; x < grid.Nodes(0); ++x) {
        const std::array<int, 3> node{x, y, z};
        for (int axis = 0; axis < 3; ++axis) {
          std::array<int, 3> next = node;
          if (++next[axis] == grid.Nodes(axis)) continue;
          const bool inside = grid.Inside(x, y, z);
          if (inside == grid.Inside(next[0], next[1], next[2])) continue;
          const int u = (axis + 1) % 3;
          const int v = (axis + 2) % 3;
          if (node[u] == 0 || node[v] == 0 || node[u] + 1 == grid.Nodes(u) ||
              node[v] + 1 == grid.Nodes(v)) {
            throw Error("implicit surface", "it leaves the box", "Enlarge the box.");
          }
          const Vec3 a = grid.Node(x, y, z);
          const Vec3 b = grid.Node(next[0], next[1], next[2]);
          const Vec3 point = inside ? Crossing(solid, a, b) : Crossing(solid, b, a);
          const Vec3 normal = SurfaceNormal(solid, point);
          // The four cells around the edge, counter-clockwise seen from its far end.
          Quad quad{};
          constexpr std::array<std::array<int, 2>, 4> kAround{{{-1, -1}, {0, -1}, {0, 0}, {-1, 0}}};
          for (int k = 0; k < 4; ++k) {
            std::array<int, 3> corner = node;
            corner[u] += kAround[k][0];
            corner[v] += kAround[k][1];
            quad.corner[inside ? k : 3 - k] = grid.Index(corner[0], corner[1], corner[2]);
            cells[grid.Index(corner[0], corner[1], corner[2])].Add(point, normal);
          }
          quads.push_back(quad);
        }
      }
    }
  }

  std::map<std::size_t, int> vertex_of_cell;
  TriangleMesh mesh;
  mesh.vertices.resize(3, cells.size());
  for (const auto& [id, planes] : cells) {
    const int vertex = static_cast<int>(vertex_of_cell.size());
    const int x = static_cast<int>(id % grid.Nodes(0));
    const int y = static_cast<int>(id / grid.Nodes(0) % grid.Nodes(1));
    const int z = static_cast<int>(id / grid.Nodes(0) / grid.Nodes(1));
    const Vec3 corner = grid.Node(x, y, z);
    mesh.vertices.col(vertex) =
        planes.Meet().cwiseMax(corner).cwiseMin(corner + Vec3::Constant(cell));
    vertex_of_cell.emplace(id, vertex);
  }
  mesh.faces.resize(3, 2 * quads.size());
  for (std::size_t q = 0; q < quads.size(); ++q) {
    std::array<int, 4> corner{};
    for (int k = 0; k < 4; ++k) corner[k] = vertex_of_cell.at(quads[q].corner[k]);
    // The diagonal that lies on the surface: along a sharp edge, never across it.
    const auto off_surface = [&](int i, int j) {
      return std::abs(solid(0.5 * (mesh.vertices.col(corner[i]) + mesh.vertices.col(corner[j]))));
    };
    const int start = off_surface(0, 2) <= off_surface(1, 3) ? 0 : 1;
    const auto at = [&](int k) { return corner[(start + k) % 4]; };
    mesh.faces.col(2 * q) << at(0), at(1), at(2);
    mesh.faces.col(2 * q + 1) << at(0), at(2), at(3);
  }
  return mesh;
}

/// Whether every edge is met once in each direction, and every vertex has a single fan of faces.
bool IsClosedManifold(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> next_around;  // (vertex, neighbour) -> following neighbour
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.faces(k, f);
      const int b = mesh.faces((k + 1) % 3, f);
      const int c = mesh.faces((k + 2) % 3, f);
      if (!next_around.emplace(std::pair(a, b), c).second) return false;
    }
  }
  for (auto it = next_around.begin(); it != next_around.end();) {
    const int vertex = it->first.first;
    std::size_t degree = 0;
    auto end = it;
    while (end != next_around.end() && end->first.first == vertex) ++end, ++degree;
    int neighbour = it->first.second;
    for (std::size_t k = 0; k < degree; ++k) {
      const auto next = next_around.find({vertex, neighbour});
      if (next == next_around.end()) return false;
      neighbour = next->second;
      if (neighbour == it->first.second && k + 1 < degree) return false;
    }
    if (neighbour != it->first.second) return false;
    it = end;
  }
  return true;
}

}  // namespace

Vec3 SurfaceNormal(const Field& solid, const Vec3& point) {
  constexpr double kStep = 0.01;
  Vec3 gradient;
  for (int k = 0; k < 3; ++k) {
    const Vec3 step = kStep * Vec3::Unit(k);
    gradient[k] = solid(point + step) - solid(point - step);
  }
  const double length = gradient.norm();
  return length > 0.0 ? Vec3(gradient / length) : Vec3::Zero();
}

TriangleMesh MeshImplicitSurface(const Field& solid, const Vec3& low, const Vec3& high,
                                 const ImplicitMesherOptions& options) {
  // Flat faces that coincide with grid planes, and cells that the surface enters twice, are
  // accidents of where the grid lies: shift it until none happens.
  constexpr std::array<double, 6> kShifts{0.382, 0.618, 0.146, 0.854, 0.271, 0.729};
  for (const double shift : kShifts) {
    const Vec3 margin = options.cell * Vec3(1.5 + shift, 1.5 + 0.5 * shift, 1.5 + 0.75 * shift);
    const TriangleMesh rough =
        Contour(solid, low - margin, high + Vec3::Constant(2.0 * options.cell), options.cell);
    if (IsClosedManifold(rough)) return RemeshOnSurface(rough, solid, options);
  }
  throw Error("implicit surface", "the grid does not resolve it as a manifold",
              "Use a smaller cell.");
}

}  // namespace holdfast
