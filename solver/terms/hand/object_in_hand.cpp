// SPDX-License-Identifier: MIT
#include "solver/terms/hand/object_in_hand.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include <Eigen/Geometry>

#include "geometry/mesh/triangle_tree.h"

namespace holdfast {
namespace {

// A sample counts if it is inside the hand: nearer to a vertex than half a finger's thickness and
// half an edge length. Lists stay valid while no vertex moves by more than their margin.
constexpr double kReach = 0.014;
constexpr double kWatchMargin = 0.002;
constexpr double kNearMargin = 0.010;

// Maximum displacement of a vertex.
double Movement(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  if (from.cols() != to.cols()) return std::numeric_limits<double>::infinity();
  return std::sqrt((from - to).colwise().squaredNorm().maxCoeff());
}

}  // namespace

// Nearest triangle to a sample, among those passed to Show().
class ObjectInHand::Nearest {
 public:
  Nearest(const Eigen::Matrix3Xd& z, const Eigen::Matrix3Xi& faces, const Eigen::Vector3d& sample)
      : z_(z), faces_(faces), sample_(sample) {}

  // Returns the squared distance of the triangle.
  double Show(int f) {
    const Eigen::Vector3d a = z_.col(faces_(0, f)), b = z_.col(faces_(1, f)),
                          c = z_.col(faces_(2, f));
    const Eigen::Vector3d closest = ClosestOnTriangle(sample_, a, b, c).point;
    const double squared = (sample_ - closest).squaredNorm();
    if (squared > nearest_ * (1.0 + 1e-9)) return squared;
    const Eigen::Vector3d face_normal = (b - a).cross(c - a).normalized();
    if (squared < nearest_ * (1.0 - 1e-9)) {
      normal_ = face_normal;
      face_ = f;
      point_ = closest;
      nearest_ = squared;
    } else {
      normal_ += face_normal;
    }
    return squared;
  }

  int Face() const { return face_; }  // -1 if Show() was not called
  const Eigen::Vector3d& Point() const { return point_; }
  double Squared() const { return nearest_; }
  // Depth below the skin, negative outside, meters.
  double Depth() const {
    return std::sqrt(nearest_) * (normal_.dot(sample_ - point_) < 0.0 ? 1.0 : -1.0);
  }

 private:
  const Eigen::Matrix3Xd& z_;
  const Eigen::Matrix3Xi& faces_;
  Eigen::Vector3d sample_;
  double nearest_ = std::numeric_limits<double>::infinity();
  int face_ = -1;
  Eigen::Vector3d point_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();  // of all triangles that contain the point
};

ObjectInHand::ObjectInHand(const HandModel& hand, const Eigen::Matrix3Xd& samples, double give_m,
                           double weight)
    : hand_(hand), samples_(samples), give_m_(give_m), scale_(std::sqrt(weight)) {
  const Eigen::Matrix3Xi& faces = hand.Surface().Faces();
  const auto count = static_cast<std::size_t>(hand.NumVertices());
  std::vector<std::set<int>> around(count), ring(count);
  std::map<std::pair<int, int>, int> uses;
  for (int f = 0; f < faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(k, f), b = faces((k + 1) % 3, f);
      around[static_cast<std::size_t>(a)].insert(f);
      ring[static_cast<std::size_t>(a)].insert(b);
      ring[static_cast<std::size_t>(b)].insert(a);
      ++uses[std::minmax(a, b)];
    }
  }
  at_edge_.assign(count, false);
  for (const auto& [edge, times] : uses) {
    if (times != 1) continue;
    for (const int end : {edge.first, edge.second}) {
      at_edge_[static_cast<std::size_t>(end)] = true;
      for (const int other : ring[static_cast<std::size_t>(end)]) {
        at_edge_[static_cast<std::size_t>(other)] = true;
      }
    }
  }
  faces_around_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::set<int> two_rings = around[i];
    for (const int j : ring[i]) {
      two_rings.insert(around[static_cast<std::size_t>(j)].begin(),
                       around[static_cast<std::size_t>(j)].end());
    }
    faces_around_[i].assign(two_rings.begin(), two_rings.end());
  }
  std::vector<int> all(count);
  std::iota(all.begin(), all.end(), 0);
  SplitVertices(std::move(all));
}

// Halves the vertices along their longest side until few are left.
void ObjectInHand::SplitVertices(std::vector<int> vertices) {
  constexpr std::size_t kMost = 16;
  if (vertices.size() <= kMost) {
    clumps_.push_back({std::move(vertices), Eigen::Vector3d::Zero(), 0.0});
    return;
  }
  const Eigen::Matrix3Xd& rest = hand_.Surface().RestVertices();
  Eigen::AlignedBox3d box;
  for (const int i : vertices) box.extend(rest.col(i));
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto middle = vertices.begin() + static_cast<std::ptrdiff_t>(vertices.size() / 2);
  std::ranges::nth_element(vertices, middle, {},
                           [&](int i) { return std::pair(rest(axis, i), i); });
  SplitVertices({vertices.begin(), middle});
  SplitVertices({middle, vertices.end()});
}

void ObjectInHand::BoundClumps(const Eigen::Matrix3Xd& z) {
  for (Clump& clump : clumps_) {
    clump.center.setZero();
    for (const int i : clump.vertices) clump.center += z.col(i);
    clump.center /= static_cast<double>(clump.vertices.size());
    double squared = 0.0;
    for (const int i : clump.vertices) {
      squared = std::max(squared, (z.col(i) - clump.center).squaredNorm());
    }
    clump.radius = std::sqrt(squared);
  }
}

// Distance and index of the nearest vertex if it is nearer than `within`; else any distance not
// below `within`.
double ObjectInHand::NearestVertex(const Eigen::Matrix3Xd& z, const Eigen::Vector3d& o,
                                   double within, int& vertex) const {
  double nearest = within, squared = within * within;
  for (const Clump& clump : clumps_) {
    const double reach = nearest + clump.radius;
    if ((o - clump.center).squaredNorm() > reach * reach) continue;
    for (const int i : clump.vertices) {
      const double here = (z.col(i) - o).squaredNorm();
      if (here > squared || (here == squared && i > vertex)) continue;
      squared = here;
      vertex = i;
    }
    nearest = std::sqrt(squared);
  }
  return nearest;
}

void ObjectInHand::FindNear(const Eigen::Matrix3Xd& z) {
  near_.clear();
  constexpr double kFar = kReach + kWatchMargin + kNearMargin;
  const Eigen::Vector3d low = z.rowwise().minCoeff().array() - kFar;
  const Eigen::Vector3d high = z.rowwise().maxCoeff().array() + kFar;
  for (Eigen::Index j = 0; j < samples_.cols(); ++j) {
    const Eigen::Vector3d o = samples_.col(j);
    if ((o.array() < low.array()).any() || (o.array() > high.array()).any()) continue;
    int vertex = 0;
    const double distance = NearestVertex(z, o, kFar, vertex);
    if (distance < kFar) near_.emplace_back(static_cast<int>(j), distance);
  }
  near_at_ = z;
}

bool ObjectInHand::Watch(const Eigen::Matrix3Xd& z) {
  if (!(Movement(watched_at_, z) > kWatchMargin)) return false;
  BoundClumps(z);
  double moved = Movement(near_at_, z);
  if (moved > kNearMargin) {
    FindNear(z);
    moved = 0.0;
  }
  watched_.clear();
  candidates_.clear();
  const Eigen::Matrix3Xi& faces = hand_.Surface().Faces();
  constexpr double kFar = kReach + kWatchMargin;
  for (const auto& [sample, distance] : near_) {
    if (distance - moved > kFar) continue;
    const Eigen::Vector3d o = samples_.col(sample);
    int vertex = -1;
    NearestVertex(z, o, kFar, vertex);
    if (vertex < 0 || at_edge_[static_cast<std::size_t>(vertex)]) continue;
    const std::size_t begin = candidates_.size();
    Nearest nearest(z, faces, o);
    for (const int f : faces_around_[static_cast<std::size_t>(vertex)]) {
      candidates_.emplace_back(std::sqrt(nearest.Show(f)), f);
    }
    const double depth = nearest.Depth();
    // The skin may move by the margin, and so may the nearest point.
    const double within = depth < -2.0 * kWatchMargin ? -1.0 : std::abs(depth) + 2.0 * kWatchMargin;
    const auto first = candidates_.begin() + static_cast<std::ptrdiff_t>(begin);
    candidates_.erase(
        std::remove_if(first, candidates_.end(), [&](const auto& c) { return c.first > within; }),
        candidates_.end());
    if (candidates_.size() == begin) continue;
    std::sort(first, candidates_.end());
    watched_.push_back({sample, depth, begin, candidates_.size()});
  }
  watched_at_ = z;
  return true;
}

double ObjectInHand::Add(const Eigen::Matrix3Xd& z, SkinRows& rows) const {
  const Eigen::Matrix3Xi& faces = hand_.Surface().Faces();
  double energy = 0.0;
  // No distance to the skin changes by more than its vertices move.
  const double moved = Movement(watched_at_, z) * (1.0 + 1e-6);
  for (const Watched& watched : watched_) {
    if (watched.depth + moved <= give_m_) continue;
    Nearest nearest(z, faces, samples_.col(watched.sample));
    for (std::size_t k = watched.begin; k < watched.end; ++k) {
      const double least = candidates_[k].first - moved;
      if (least > 0.0 && least * least > nearest.Squared() * (1.0 + 1e-6)) break;
      nearest.Show(candidates_[k].second);
    }
    const double depth = nearest.Depth();
    if (depth <= give_m_) continue;
    // The distance changes as if the nearest point were fixed in its triangle.
    const Eigen::Vector3i corner = faces.col(nearest.Face());
    const Eigen::Vector3d a = z.col(corner(0)), b = z.col(corner(1)), c = z.col(corner(2));
    const Eigen::Vector3d n = (b - a).cross(c - a);
    const double area = n.squaredNorm();
    const Eigen::Vector3d& at = nearest.Point();
    const Eigen::Vector3d share((c - b).cross(at - b).dot(n) / area,
                                (a - c).cross(at - c).dot(n) / area,
                                (b - a).cross(at - a).dot(n) / area);
    const Eigen::Vector3d slope = -scale_ / depth * (samples_.col(watched.sample) - at);
    rows.Begin(scale_ * (depth - give_m_));
    for (int k = 0; k < 3; ++k) {
      if (share(k) != 0.0) rows.Add(corner(k), share(k) * slope);
    }
    energy += (depth - give_m_) * (depth - give_m_);
  }
  return energy;
}

}  // namespace holdfast
