// SPDX-License-Identifier: MIT
#include "solver/take/take_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <unordered_set>
#include <utility>
#include <vector>

#include "geometry/body/own_body.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kColumnRadius = 0.025, kFootRadius = 0.15, kFootHeight = 0.02;
constexpr int kSides = 32;
constexpr double kClearance = 0.01;  // to the body, if possible

double BoxDistance(const Vector3d& p, const Vector3d& half) {
  const Vector3d q = p.cwiseAbs() - half;
  return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
}

// A cylinder about z between two heights.
double CylinderDistance(const Vector3d& p, double radius, double low, double high) {
  const Eigen::Vector2d q(p.head<2>().norm() - radius,
                          std::abs(p.z() - 0.5 * (low + high)) - 0.5 * (high - low));
  return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
}

// A prism over a convex outline (2 x n, counterclockwise).
void AddPrism(const Eigen::Matrix2Xd& outline, double low, double high, TriangleMesh& mesh) {
  const auto n = static_cast<int>(outline.cols());
  const auto first = static_cast<int>(mesh.vertices.cols());
  const auto face = mesh.faces.cols();
  mesh.vertices.conservativeResize(Eigen::NoChange, first + 2 * n);
  mesh.faces.conservativeResize(Eigen::NoChange, face + 4 * n - 4);
  Eigen::Index at = face;
  for (int i = 0; i < n; ++i) {
    const int j = (i + 1) % n;
    mesh.vertices.col(first + i) << outline.col(i), low;
    mesh.vertices.col(first + n + i) << outline.col(i), high;
    mesh.faces.col(at++) << first + i, first + j, first + n + j;
    mesh.faces.col(at++) << first + i, first + n + j, first + n + i;
    if (i + 2 >= n) continue;
    mesh.faces.col(at++) << first, first + i + 2, first + i + 1;
    mesh.faces.col(at++) << first + n, first + n + i + 1, first + n + i + 2;
  }
}

Eigen::Matrix2Xd Circle(double radius) {
  Eigen::Matrix2Xd outline(2, kSides);
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    outline.col(i) << radius * std::cos(angle), radius * std::sin(angle);
  }
  return outline;
}

// Heights of column and foot below the upper face; none if the top is on the ground.
struct Below {
  double column_top, foot_top, ground;
  bool has_column, has_foot;
};
Below PartsBelow(const SideTable& table) {
  const double ground = -table.height_m;
  const double column_top = -std::min(table.thickness_m, table.height_m);
  return {column_top, ground + kFootHeight, ground, column_top - (ground + kFootHeight) > 1e-6,
          column_top - ground > kFootHeight};
}

// Distance of a point in the table's frame.
double DistanceFrom(const SideTable& table, const Below& below, const Vector3d& p) {
  const double thick = -below.column_top, half = 0.5 * table.width_m;
  const Vector3d from_middle = p + Vector3d(0.0, 0.0, 0.5 * thick);
  double distance = BoxDistance(from_middle, Vector3d(half, half, 0.5 * thick));
  if (below.has_column) {
    distance =
        std::min(distance, CylinderDistance(p, kColumnRadius, below.foot_top, below.column_top));
  }
  if (below.has_foot) {
    distance = std::min(distance, CylinderDistance(p, kFootRadius, below.ground, below.foot_top));
  }
  return distance;
}

}  // namespace

TriangleMesh SideTable::Mesh() const {
  TriangleMesh mesh;
  const double half = 0.5 * width_m;
  Eigen::Matrix2Xd square(2, 4);
  square << half, -half, -half, half, half, half, -half, -half;
  const Below below = PartsBelow(*this);
  AddPrism(square, height_m > 1e-6 ? below.column_top : -1e-3, 0.0, mesh);
  if (below.has_column) AddPrism(Circle(kColumnRadius), below.foot_top, below.column_top, mesh);
  if (below.has_foot) AddPrism(Circle(kFootRadius), below.ground, below.foot_top, mesh);
  return mesh;
}

double SideTable::Distance(const Vector3d& point_world) const {
  return DistanceFrom(*this, PartsBelow(*this), world_from_table.inverse() * point_world);
}

SideTable TableAt(const Vector3d& bottom_middle, double yaw_rad, double ahead_m, double aside_m) {
  SideTable table;
  table.height_m = bottom_middle.z();
  // In the table's frame the person looks along +x; the object is at (ahead - width/2, aside).
  table.world_from_table =
      PoseAt(Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).toRotationMatrix(),
             Vector3d(ahead_m - 0.5 * table.width_m, aside_m, 0.0), bottom_middle);
  return table;
}

TablePlacement PlaceTable(const Vector3d& bottom_middle, double yaw_rad, double margin_m,
                          const Eigen::Matrix3Xd& body_points) {
  const double width = SideTable().width_m;
  // Points within range, one per centimeter cell.
  constexpr double kCell = 0.01;
  std::unordered_set<std::int64_t> seen;
  std::vector<Vector3d> points;
  for (Eigen::Index i = 0; i < body_points.cols(); ++i) {
    const Vector3d from = body_points.col(i) - bottom_middle;
    if (from.z() > kClearance || from.head<2>().norm() > 1.5 * width) continue;
    const Eigen::Array3i cell = (from / kCell).array().floor().cast<int>();
    const std::int64_t key = (static_cast<std::int64_t>(cell.x() + 1024) << 40) +
                             (static_cast<std::int64_t>(cell.y() + 1024) << 20) + cell.z() + 1024;
    if (seen.insert(key).second) points.push_back(body_points.col(i));
  }
  const double margin = std::min(margin_m, 0.5 * width);
  TablePlacement best;
  double least = std::numeric_limits<double>::infinity();
  constexpr double kStep = 0.03;
  const int steps = static_cast<int>(std::floor((width - 2.0 * margin) / kStep + 1e-9));
  for (int turn = 0; turn <= 12; ++turn) {
    const int sign = turn % 2 == 0 ? 1 : -1;
    const double turned = sign * ((turn + 1) / 2) * std::numbers::pi / 18.0;
    for (int a = 0; a <= steps; ++a) {
      for (int b = 0; b <= steps; ++b) {
        const double aside = (b % 2 == 0 ? 1 : -1) * ((b + 1) / 2) * kStep;
        const SideTable table = TableAt(bottom_middle, yaw_rad + turned, margin + a * kStep, aside);
        // Meters: low weight on deviation from the default placement.
        const double plain = 1e-3 * (a + std::abs(aside) / kStep) +
                             4e-3 * std::abs(turned) / (std::numbers::pi / 18.0);
        if (0.1 * plain >= least) continue;
        const Eigen::Isometry3d table_from_world = table.world_from_table.inverse();
        const Below below = PartsBelow(table);
        double nearest = std::numeric_limits<double>::infinity();
        for (Vector3d& p : points) {
          nearest = std::min(nearest, DistanceFrom(table, below, table_from_world * p));
          if (10.0 * (kClearance - nearest) + 0.1 * plain < least) continue;
          std::swap(p, points.front());  // likely collides with the next table too
          break;
        }
        const double cost = 10.0 * std::max(0.0, kClearance - nearest) + 0.1 * plain;
        if (cost < least) {
          least = cost;
          best = {table, std::max(0.0, -nearest)};
        }
      }
    }
  }
  return best;
}

double TableMargin(const TriangleMesh& mesh) {
  return std::min(0.2, 0.5 * Extent(mesh).head<2>().norm() + 0.01);
}

Eigen::Matrix3Xd SkinNearTable(const Clip& clip, const BodySurface& surface,
                               const Vector3d& bottom_middle, int threads, std::vector<int> frames,
                               bool with_arms) {
  constexpr double kNear = 0.7, kAbove = 0.02;
  if (frames.empty()) {
    frames.resize(static_cast<std::size_t>(clip.NumFrames()));
    std::iota(frames.begin(), frames.end(), 0);
  }
  std::vector<bool> left_out(static_cast<std::size_t>(surface.RestVertices().cols()), false);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if (with_arms) break;
    for (const int i : OwnBody::ForearmAndHand(surface, side)) left_out[i] = true;
  }
  std::vector<Eigen::Matrix3Xd> kept(frames.size());
  ParallelFor(static_cast<int>(kept.size()), threads, [&](int k) {
    const int t = frames[k];
    BodyState state;
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    Eigen::Matrix3Xd near(3, state.vertices.cols());
    Eigen::Index count = 0;
    for (Eigen::Index i = 0; i < state.vertices.cols(); ++i) {
      const Vector3d from = state.vertices.col(i) - bottom_middle;
      if (!left_out[i] && from.z() < kAbove && from.head<2>().norm() < kNear)
        near.col(count++) = state.vertices.col(i);
    }
    near.conservativeResize(3, count);
    kept[k] = std::move(near);
  });
  Eigen::Index total = 0;
  for (const Eigen::Matrix3Xd& points : kept) total += points.cols();
  Eigen::Matrix3Xd all(3, total);
  Eigen::Index at = 0;
  for (const Eigen::Matrix3Xd& points : kept) {
    all.middleCols(at, points.cols()) = points;
    at += points.cols();
  }
  return all;
}

void SetTable(const SideTable& table, Clip& clip) {
  ObjectTrack track;
  track.name = "table";
  track.mesh = "table.ply";
  track.surface = std::make_shared<const TriangleMesh>(table.Mesh());
  track.trans = table.world_from_table.translation().replicate(1, clip.NumFrames());
  track.orient = LogSO3(table.world_from_table.linear()).replicate(1, clip.NumFrames());
  clip.table = std::move(track);
}

void AddTable(std::span<const int> frames, const BodySurface& body, const TriangleMesh& object,
              int threads, Clip& clip) {
  constexpr int kMaxFrames = 150;  // with skin to avoid
  Eigen::Matrix3Xd bottoms(3, static_cast<Eigen::Index>(frames.size()));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Eigen::Matrix3Xd placed = clip.object->Pose(frames[i]) * object.vertices;
    bottoms.col(i) << 0.5 * (placed.rowwise().minCoeff() + placed.rowwise().maxCoeff()).head<2>(),
        placed.row(2).minCoeff();
  }
  const Vector3d middle = bottoms.rowwise().mean();
  const double spread = (bottoms.colwise() - middle).colwise().norm().maxCoeff();
  const Vector3d ahead = middle - (clip.trans.col(frames.front()) + body.RestJoints().col(0));
  std::vector<int> looked;
  for (int t = 0; t < clip.NumFrames(); t += 1 + clip.NumFrames() / kMaxFrames) looked.push_back(t);
  const Eigen::Matrix3Xd trunk = SkinNearTable(clip, body, middle, threads, looked, false),
                         ends =
                             SkinNearTable(clip, body, middle, threads, {0, clip.NumFrames() - 1});
  Eigen::Matrix3Xd all(3, trunk.cols() + ends.cols());
  all << trunk, ends;
  constexpr double kNearEdge = 0.6;  // of the margin, for an object close to the person
  const double margin = TableMargin(object) + spread;
  const auto place = [&](const Eigen::Matrix3Xd& skin, double margin_m) {
    return PlaceTable(middle, std::atan2(ahead.y(), ahead.x()), margin_m, skin);
  };
  TablePlacement placed = place(all, margin);
  if (placed.deepest_m > 0.0) placed = place(trunk, margin);
  if (placed.deepest_m > 0.0) placed = place(trunk, kNearEdge * margin);
  SetTable(placed.table, clip);
}

}  // namespace holdfast
