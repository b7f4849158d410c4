// SPDX-License-Identifier: MIT
#include "solver/terms/hand/object_in_hand.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <utility>

#include <Eigen/Geometry>

#include "geometry/mesh/triangle_tree.h"

namespace holdfast {
namespace {

// A sample counts when it is inside, that is, nearer to a vertex than half a finger is thick and
// half an edge is long. Lists stay valid while no vertex moves more than their margin.
constexpr double kReach = 0.014;
constexpr double kWatchMargin = 0.002;
constexpr double kNearMargin = 0.010;

bool Moved(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, double margin) {
  if (from.cols() != to.cols()) return true;
  return (from - to).colwise().squaredNorm().maxCoeff() > margin * margin;
}

}  // namespace

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
}

void ObjectInHand::FindNear(const Eigen::Matrix3Xd& z) {
  near_.clear();
  constexpr double kFar = kReach + kWatchMargin + kNearMargin;
  const Eigen::Vector3d low = z.rowwise().minCoeff().array() - kFar;
  const Eigen::Vector3d high = z.rowwise().maxCoeff().array() + kFar;
  for (Eigen::Index j = 0; j < samples_.cols(); ++j) {
    const Eigen::Vector3d o = samples_.col(j);
    if ((o.array() < low.array()).any() || (o.array() > high.array()).any()) continue;
    if ((z.colwise() - o).colwise().squaredNorm().minCoeff() < kFar * kFar) {
      near_.push_back(static_cast<int>(j));
    }
  }
  near_at_ = z;
}

template <typename Faces>
ObjectInHand::Nearest ObjectInHand::FindNearest(const Eigen::Matrix3Xd& z, int sample,
                                                const Faces& among) const {
  const Eigen::Matrix3Xi& faces = hand_.Surface().Faces();
  const Eigen::Vector3d o = samples_.col(sample);
  double nearest = std::numeric_limits<double>::infinity();
  Nearest result{0.0, -1, Eigen::Vector3d::Zero()};
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of all faces that hold the nearest point
  for (const int f : among) {
    const Eigen::Vector3d a = z.col(faces(0, f)), b = z.col(faces(1, f)), c = z.col(faces(2, f));
    const Eigen::Vector3d closest = ClosestOnTriangle(o, a, b, c).point;
    const double squared = (o - closest).squaredNorm();
    if (squared > nearest * (1.0 + 1e-9)) continue;
    const Eigen::Vector3d face_normal = (b - a).cross(c - a).normalized();
    if (squared < nearest * (1.0 - 1e-9)) {
      normal = face_normal;
      result.face = f;
      result.point = closest;
      nearest = squared;
    } else {
      normal += face_normal;
    }
  }
  result.depth = std::sqrt(nearest) * (normal.dot(o - result.point) < 0.0 ? 1.0 : -1.0);
  return result;
}

bool ObjectInHand::Watch(const Eigen::Matrix3Xd& z) {
  if (!Moved(watched_at_, z, kWatchMargin)) return false;
  if (Moved(near_at_, z, kNearMargin)) FindNear(z);
  watched_.clear();
  candidates_.clear();
  const Eigen::Matrix3Xi& faces = hand_.Surface().Faces();
  for (const int j : near_) {
    const Eigen::Vector3d o = samples_.col(j);
    Eigen::Index vertex = 0;
    const double squared = (z.colwise() - o).colwise().squaredNorm().minCoeff(&vertex);
    constexpr double kFar = kReach + kWatchMargin;
    if (squared > kFar * kFar || at_edge_[static_cast<std::size_t>(vertex)]) continue;
    const std::vector<int>& around = faces_around_[static_cast<std::size_t>(vertex)];
    const double depth = FindNearest(z, j, around).depth;
    if (depth < -2.0 * kWatchMargin) continue;
    // The skin may move by the margin, and so may what is nearest to the sample.
    const double within = std::abs(depth) + 2.0 * kWatchMargin;
    const std::size_t begin = candidates_.size();
    for (const int f : around) {
      const Eigen::Vector3d closest =
          ClosestOnTriangle(o, z.col(faces(0, f)), z.col(faces(1, f)), z.col(faces(2, f))).point;
      if ((closest - o).squaredNorm() <= within * within) candidates_.push_back(f);
    }
    watched_.push_back({j, begin, candidates_.size()});
  }
  watched_at_ = z;
  return true;
}

double ObjectInHand::Add(const Eigen::Matrix3Xd& z, SkinRows& rows) const {
  const Eigen::Matrix3Xi& faces = hand_.Surface().Faces();
  double energy = 0.0;
  for (const Watched& watched : watched_) {
    const Nearest nearest =
        FindNearest(z, watched.sample,
                    std::span(candidates_).subspan(watched.begin, watched.end - watched.begin));
    const double depth = nearest.depth;
    if (nearest.face < 0 || depth <= give_m_) continue;
    // The distance changes with the nearest point as if that were fixed in its triangle.
    const Eigen::Vector3i corner = faces.col(nearest.face);
    const Eigen::Vector3d a = z.col(corner(0)), b = z.col(corner(1)), c = z.col(corner(2));
    const Eigen::Vector3d n = (b - a).cross(c - a);
    const double area = n.squaredNorm();
    const Eigen::Vector3d& at = nearest.point;
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
