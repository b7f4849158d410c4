// SPDX-License-Identifier: MIT
#include "solver/transfer/surface_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include <ceres/autodiff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>
#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include "geometry/error.h"
#include "geometry/mesh/nearest.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/pose.h"
#include "geometry/rotation.h"
#include "solver/unknowns/quiet_ceres.h"

namespace holdfast {

/// Points of a surface with their outward normals.
struct OrientedPoints {
  Eigen::Matrix3Xd at, normal;
  Eigen::Index Count() const { return at.cols(); }
};

namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr int kNodesOfPoint = 4;

OrientedPoints SampleOriented(const TriangleMesh& mesh, const SignedDistance& surface, int count) {
  OrientedPoints points{SampleSurface(mesh, count), {}};
  points.normal.resize(3, points.at.cols());
  for (Eigen::Index i = 0; i < points.at.cols(); ++i) {
    points.normal.col(i) = surface.Query(points.at.col(i)).gradient;
  }
  return points;
}

struct Box {
  Vector3d low, high;
  Vector3d Center() const { return 0.5 * (low + high); }
  Vector3d Extent() const { return high - low; }
};

Box BoxOf(const Matrix3Xd& points) {
  return {points.rowwise().minCoeff(), points.rowwise().maxCoeff()};
}

// Nodes near a point with their weights, which sum to 1.
struct NodeWeights {
  std::array<int, kNodesOfPoint> node{};
  std::array<double, kNodesOfPoint> weight{};
};

template <typename Nodes>
NodeWeights WeightsAt(const Nodes& nodes, const Vector3d& point) {
  constexpr int kNearest = kNodesOfPoint + 1;  // the last one gives the distance of no weight
  std::array<std::pair<double, int>, kNearest> nearest;
  nearest.fill({std::numeric_limits<double>::infinity(), 0});
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    std::pair<double, int> candidate((nodes[k].at - point).norm(), static_cast<int>(k));
    for (auto& held : nearest) {
      if (candidate < held) std::swap(candidate, held);
    }
  }
  NodeWeights found;
  double sum = 0.0;
  for (int k = 0; k < kNodesOfPoint; ++k) {
    found.node[k] = nearest[k].second;
    const double share = 1.0 - nearest[k].first / (nearest.back().first + 1e-12);
    found.weight[k] = std::max(1e-9, share * share);
    sum += found.weight[k];
  }
  for (double& weight : found.weight) weight /= sum;
  return found;
}

// A bent point and where it is to be: along the normal of the surface there, and a little across.
struct GoalOfPoint {
  GoalOfPoint(const Vector3d& point, std::array<Vector3d, kNodesOfPoint> nodes,
              const std::array<double, kNodesOfPoint>& weights, const Vector3d& goal,
              const Vector3d& normal, double along, double across)
      : point_(point),
        nodes_(std::move(nodes)),
        weights_(weights),
        goal_(goal),
        normal_(normal),
        along_(along),
        across_(across) {}

  template <typename T>
  bool operator()(const T* a, const T* b, const T* c, const T* d, T* residuals) const {
    const T* const unknowns[kNodesOfPoint] = {a, b, c, d};
    T bent[3] = {T(0), T(0), T(0)};
    for (int k = 0; k < kNodesOfPoint; ++k) {
      const T offset[3] = {T(point_.x() - nodes_[k].x()), T(point_.y() - nodes_[k].y()),
                           T(point_.z() - nodes_[k].z())};
      T turned[3];
      ceres::AngleAxisRotatePoint(unknowns[k], offset, turned);
      for (int i = 0; i < 3; ++i) {
        bent[i] += weights_[k] * (turned[i] + nodes_[k](i) + unknowns[k][3 + i]);
      }
    }
    residuals[3] = T(0);
    for (int i = 0; i < 3; ++i) {
      const T off = bent[i] - goal_(i);
      residuals[i] = across_ * off;
      residuals[3] += along_ * normal_(i) * off;
    }
    return true;
  }

 private:
  Vector3d point_;
  std::array<Vector3d, kNodesOfPoint> nodes_;
  std::array<double, kNodesOfPoint> weights_;
  Vector3d goal_, normal_;
  double along_, across_;
};

// A node moves its neighbor as the neighbor moves itself.
struct RigidNeighbors {
  Vector3d edge;  // to the neighbor
  double weight;

  template <typename T>
  bool operator()(const T* own, const T* neighbor, T* residuals) const {
    const T along[3] = {T(edge.x()), T(edge.y()), T(edge.z())};
    T turned[3];
    ceres::AngleAxisRotatePoint(own, along, turned);
    for (int i = 0; i < 3; ++i) {
      residuals[i] = weight * (turned[i] + own[3 + i] - along[i] - neighbor[3 + i]);
    }
    return true;
  }
};

// Rotations that the one object may have to make: about z, then of axes of inertia onto each other.
std::vector<Matrix3d> StartRotations(const Matrix3Xd& from, const Matrix3Xd& to) {
  std::vector<Matrix3d> starts;
  constexpr int kTurns = 24;
  for (int k = 0; k < kTurns; ++k) {
    starts.push_back(ExpSO3(Vector3d(0.0, 0.0, 2.0 * std::numbers::pi * k / kTurns)));
  }
  const auto axes = [](const Matrix3Xd& points) {
    const Matrix3Xd off = points.colwise() - points.rowwise().mean();
    Matrix3d vectors =
        Eigen::SelfAdjointEigenSolver<Matrix3d>(off * off.transpose()).eigenvectors();
    if (vectors.determinant() < 0.0) vectors.col(0) *= -1.0;
    return vectors;
  };
  const Matrix3d axes_from = axes(from), axes_to = axes(to);
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d turn = Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) turn(i, order[i]) = (signs >> i) % 2 == 0 ? 1.0 : -1.0;
      if (turn.determinant() < 0.0) continue;
      starts.push_back(turn);
      starts.push_back(axes_to * turn * axes_from.transpose());
    }
  } while (std::ranges::next_permutation(order).found);
  return starts;
}

}  // namespace

// Finds a map in its steps: turned and scaled, then bent. Normals count as far as kNormal_m.
class MapFinder {
 public:
  MapFinder(const TriangleMesh& from, const TriangleMesh& to, const SurfaceMapOptions& options)
      : options_(options), from_surface_(from) {
    map_.to_ = std::make_shared<const SignedDistance>(to);
    from_ = SampleOriented(from, from_surface_, options.samples);
    to_ = SampleOriented(to, *map_.to_, options.samples);
    size_ = BoxOf(to.vertices).Extent().norm();
    to_tree_.emplace(Lifted(to_));
  }

  SurfaceMap ByShape() {
    map_.report_.method = MapMethod::kRegistered;
    Align();
    MakeNodes();
    for (const double stiffness : {3.0, 1.0, 0.5, 0.25, 0.25}) BendToShape(stiffness);
    return std::move(map_);
  }

  SurfaceMap ByPairs(const Matrix3Xd& on_from, const Matrix3Xd& on_to) {
    map_.report_.method = MapMethod::kGiven;
    PlaceByPairs(on_from, on_to);
    MakeNodes();
    std::vector<Match> matches;
    for (Eigen::Index i = 0; i < on_from.cols(); ++i) {
      matches.push_back({map_.Placed(on_from.col(i)), on_to.col(i), Vector3d::Zero()});
    }
    for (int round = 0; round < 3; ++round) Bend(matches, 0.05);
    return std::move(map_);
  }

 private:
  struct Match {
    Vector3d placed, goal, normal;  // no normal: the goal itself
  };

  // Points with their normals as places: the two sides of a wall are apart.
  Matrix3Xd Lifted(const OrientedPoints& points) const {
    return points.at + Lift() * points.normal;
  }
  double Lift() const { return std::clamp(0.06 * size_, 0.002, 0.010); }

  // Q, s and b for a turn: boxes onto each other.
  void SetPlaced(const Matrix3d& turn, SurfaceMap& map) const {
    const Box box_from = BoxOf(from_.at), box_to = BoxOf(turn.transpose() * to_.at);
    const Vector3d scale = box_to.Extent().cwiseQuotient(box_from.Extent().cwiseMax(1e-4));
    map.rotation_ = turn;
    map.report_.scale = scale;
    map.linear_ = turn * scale.asDiagonal();
    map.offset_ = turn * box_to.Center() - map.linear_ * box_from.Center();
  }

  OrientedPoints Moved(const SurfaceMap& map) const {
    OrientedPoints moved = from_;
    moved.at = (map.linear_ * from_.at).colwise() + map.offset_;
    moved.normal = map.rotation_ * map.report_.scale.cwiseInverse().asDiagonal() * from_.normal;
    moved.normal.colwise().normalize();
    return moved;
  }

  // Mean squared distance of lifted points, both ways; every `stride`-th counts.
  double Mismatch(const SurfaceMap& map, int stride) const {
    const Matrix3Xd moved = Lifted(Moved(map));
    const Matrix3Xd other = Lifted(to_);
    Matrix3Xd some(3, (moved.cols() + stride - 1) / stride);
    for (Eigen::Index i = 0; i < some.cols(); ++i) some.col(i) = moved.col(i * stride);
    const NearestPoints tree(some);
    const double most = 0.15 * size_;
    double sum = 0.0;
    for (Eigen::Index i = 0; i < some.cols(); ++i) {
      sum += std::pow(std::min(most, to_tree_->Nearest(some.col(i)).distance), 2);
      sum += std::pow(std::min(most, tree.Nearest(other.col(i * stride)).distance), 2);
    }
    return sum / static_cast<double>(2 * some.cols());
  }

  // Among turns that are as good within a fifth, the least, and no tilt if that may be.
  void Align() {
    constexpr int kStride = 5;
    constexpr std::size_t kKept = 6;
    std::vector<std::pair<double, Matrix3d>> starts;
    for (const Matrix3d& turn : StartRotations(from_.at, to_.at)) {
      SetPlaced(turn, map_);
      starts.emplace_back(Cost(Mismatch(map_, kStride), turn), turn);
    }
    std::ranges::stable_sort(starts, {}, &std::pair<double, Matrix3d>::first);
    double least = std::numeric_limits<double>::infinity();
    Matrix3d best = Matrix3d::Identity();
    for (std::size_t k = 0; k < std::min(kKept, starts.size()); ++k) {
      const Matrix3d turn = Iterated(starts[k].second);
      SetPlaced(turn, map_);
      const double cost = Cost(Mismatch(map_, 1), turn);
      if (cost < least) least = cost, best = turn;
    }
    SetPlaced(best, map_);
    map_.report_.turned_deg = LogSO3(best).norm() / kDegree;
  }

  // The mismatch with what turning costs: up to a tenth for a tilt, a tenth for the angle. A floor
  // of what sampling alone makes.
  double Cost(double mismatch, const Matrix3d& turn) const {
    const double tilt = std::acos(std::clamp(turn(2, 2), -1.0, 1.0)) / std::numbers::pi;
    const double angle = LogSO3(turn).norm() / std::numbers::pi;
    return (mismatch + 1e-4 * size_ * size_) * (1.0 + 0.1 * tilt + 0.1 * angle);
  }

  // ICP of the turn alone; boxes give scale and place.
  Matrix3d Iterated(Matrix3d turn) {
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds; ++round) {
      SetPlaced(turn, map_);
      const OrientedPoints moved = Moved(map_);
      const Matrix3Xd lifted = Lifted(moved);
      const Vector3d center = BoxOf(moved.at).Center();
      Matrix3d covariance = Matrix3d::Zero();
      for (Eigen::Index i = 0; i < lifted.cols(); i += 2) {
        const NearestPoints::Neighbour near = to_tree_->Nearest(lifted.col(i));
        if (near.distance > 0.15 * size_) continue;
        covariance += (to_.at.col(near.id) - center) * (moved.at.col(i) - center).transpose();
      }
      const Matrix3d step = NearestRotation(covariance);
      turn = step * turn;
      if (LogSO3(step).norm() < 0.2 * kDegree) break;
    }
    return NearestRotation(turn);
  }

  void PlaceByPairs(const Matrix3Xd& on_from, const Matrix3Xd& on_to) {
    const Vector3d a = on_from.rowwise().mean(), b = on_to.rowwise().mean();
    const Matrix3Xd off_a = on_from.colwise() - a, off_b = on_to.colwise() - b;
    const Matrix3d turn = NearestRotation(off_b * off_a.transpose());
    const double scale = std::sqrt(off_b.squaredNorm() / std::max(1e-12, off_a.squaredNorm()));
    map_.rotation_ = turn;
    map_.report_.scale.setConstant(scale);
    map_.report_.turned_deg = LogSO3(turn).norm() / kDegree;
    map_.linear_ = scale * turn;
    map_.offset_ = b - map_.linear_ * a;
  }

  // Nodes evenly over the placed surface: each the farthest from those before.
  void MakeNodes() {
    const Matrix3Xd placed = (map_.linear_ * from_.at).colwise() + map_.offset_;
    Eigen::VectorXd distance =
        Eigen::VectorXd::Constant(placed.cols(), std::numeric_limits<double>::infinity());
    Eigen::Index next = 0;
    const int count = std::min<int>(options_.nodes, static_cast<int>(placed.cols()));
    for (int k = 0; k < count; ++k) {
      SurfaceMap::Node node;
      node.at = placed.col(next);
      map_.nodes_.push_back(node);
      distance =
          distance.cwiseMin((placed.colwise() - node.at).colwise().norm().transpose().eval());
      distance.maxCoeff(&next);
    }
    constexpr std::size_t kNeighbors = 6;
    for (std::size_t k = 0; k < map_.nodes_.size(); ++k) {
      std::vector<std::pair<double, std::size_t>> near;
      for (std::size_t l = 0; l < map_.nodes_.size(); ++l) {
        if (l != k) near.emplace_back((map_.nodes_[l].at - map_.nodes_[k].at).norm(), l);
      }
      std::ranges::sort(near);
      for (std::size_t n = 0; n < std::min(kNeighbors, near.size()); ++n) {
        edges_.emplace_back(k, near[n].second);
      }
    }
  }

  void BendToShape(double stiffness) {
    OrientedPoints bent = from_;
    for (Eigen::Index i = 0; i < bent.Count(); ++i) {
      bent.at.col(i) = map_.Warp(from_.at.col(i));
      const Vector3d normal = map_.report_.scale.cwiseInverse().asDiagonal() * from_.normal.col(i);
      bent.normal.col(i) = (map_.Turn(from_.at.col(i)) * normal).normalized();
    }
    const Matrix3Xd lifted = Lifted(bent);
    const NearestPoints tree(lifted);
    const Matrix3Xd lifted_to = Lifted(to_);
    const double most = 0.2 * size_;
    std::vector<Match> matches;
    for (Eigen::Index i = 0; i < bent.Count(); ++i) {
      const NearestPoints::Neighbour near = to_tree_->Nearest(lifted.col(i));
      if (near.distance > most || to_.normal.col(near.id).dot(bent.normal.col(i)) < 0.2) continue;
      matches.push_back(
          {map_.Placed(from_.at.col(i)), to_.at.col(near.id), to_.normal.col(near.id)});
    }
    for (Eigen::Index j = 0; j < to_.Count(); ++j) {
      const NearestPoints::Neighbour near = tree.Nearest(lifted_to.col(j));
      if (near.distance > most || to_.normal.col(j).dot(bent.normal.col(near.id)) < 0.2) continue;
      matches.push_back({map_.Placed(from_.at.col(near.id)), to_.at.col(j), to_.normal.col(j)});
    }
    Bend(matches, stiffness);
  }

  void Bend(const std::vector<Match>& matches, double stiffness) {
    std::vector<std::array<double, 6>> unknowns(map_.nodes_.size());
    for (std::size_t k = 0; k < unknowns.size(); ++k) {
      const Vector3d turn = LogSO3(map_.nodes_[k].turn);
      Eigen::Map<Vector3d>(unknowns[k].data()) = turn;
      Eigen::Map<Vector3d>(unknowns[k].data() + 3) = map_.nodes_[k].shift;
    }
    ceres::Problem problem;
    const double share =
        1.0 / std::sqrt(std::max<double>(1.0, static_cast<double>(matches.size())));
    for (const Match& match : matches) {
      const NodeWeights near = WeightsAt(map_.nodes_, match.placed);
      std::array<Vector3d, kNodesOfPoint> nodes;
      for (int k = 0; k < kNodesOfPoint; ++k) nodes[k] = map_.nodes_[near.node[k]].at;
      const bool plane = !match.normal.isZero(0.0);
      auto* goal = new GoalOfPoint(match.placed, nodes, near.weight, match.goal, match.normal,
                                   plane ? share : 0.0, plane ? 0.3 * share : share);
      auto* cost = new ceres::AutoDiffCostFunction<GoalOfPoint, 4, 6, 6, 6, 6>(goal);
      problem.AddResidualBlock(cost, nullptr, unknowns[near.node[0]].data(),
                               unknowns[near.node[1]].data(), unknowns[near.node[2]].data(),
                               unknowns[near.node[3]].data());
    }
    const double rigid = std::sqrt(stiffness / static_cast<double>(edges_.size()));
    for (const auto& [k, l] : edges_) {
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<RigidNeighbors, 3, 6, 6>(
              new RigidNeighbors{map_.nodes_[l].at - map_.nodes_[k].at, rigid}),
          nullptr, unknowns[k].data(), unknowns[l].data());
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 6;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) return;
    for (std::size_t k = 0; k < unknowns.size(); ++k) {
      map_.nodes_[k].turn = ExpSO3(Eigen::Map<const Vector3d>(unknowns[k].data()));
      map_.nodes_[k].shift = Eigen::Map<const Vector3d>(unknowns[k].data() + 3);
    }
  }

  SurfaceMapOptions options_;
  SignedDistance from_surface_;
  OrientedPoints from_, to_;
  double size_ = 0.0;  // of the second object, its diagonal
  std::optional<NearestPoints> to_tree_;
  std::vector<std::pair<std::size_t, std::size_t>> edges_;
  SurfaceMap map_;
};

std::string_view MethodName(MapMethod method) {
  switch (method) {
    case MapMethod::kScaled:
      return "scaled";
    case MapMethod::kRegistered:
      return "registered";
    case MapMethod::kGiven:
      return "given";
  }
  return "";
}

Vector3d SurfaceMap::Warp(const Vector3d& point) const {
  const Vector3d placed = Placed(point);
  if (nodes_.empty()) return placed;
  const NodeWeights near = WeightsAt(nodes_, placed);
  Vector3d bent = Vector3d::Zero();
  for (int k = 0; k < kNodesOfPoint; ++k) {
    const Node& node = nodes_[near.node[k]];
    bent += near.weight[k] * (node.turn * (placed - node.at) + node.at + node.shift);
  }
  return bent;
}

Matrix3d SurfaceMap::Turn(const Vector3d& point) const {
  if (nodes_.empty()) return rotation_;
  const NodeWeights near = WeightsAt(nodes_, Placed(point));
  Matrix3d turn = Matrix3d::Zero();
  for (int k = 0; k < kNodesOfPoint; ++k) turn += near.weight[k] * nodes_[near.node[k]].turn;
  return NearestRotation(turn * rotation_);
}

SurfaceMap::Image SurfaceMap::At(const Vector3d& point, const Vector3d& normal) const {
  if (!to_) {  // scaled: exactly there
    return {Placed(point),
            (rotation_ * report_.scale.cwiseInverse().asDiagonal() * normal).normalized()};
  }
  // From a little outside, so that of a thin wall its near side is the nearest.
  constexpr double kOutside_m = 0.003;
  const Vector3d outwards =
      (Turn(point) * report_.scale.cwiseInverse().asDiagonal() * normal).normalized();
  const SignedDistance::Result hit = to_->Query(Warp(point) + kOutside_m * outwards);
  const SignedDistance::Result there = to_->Query(hit.closest);
  return {hit.closest, there.gradient.norm() > 0.5 ? there.gradient.normalized() : outwards};
}

void SurfaceMap::Measure(const TriangleMesh& from, const TriangleMesh& to) {
  constexpr int kPoints = 600, kStretched = 200;
  const SignedDistance surface(from);
  const OrientedPoints points = SampleOriented(from, surface, kPoints);
  Matrix3Xd carried(3, points.Count());
  double squares = 0.0;
  for (Eigen::Index i = 0; i < points.Count(); ++i) {
    carried.col(i) = Warp(points.at.col(i));
    squares += std::pow(to_->Query(carried.col(i)).distance, 2);
  }
  report_.residual_mm = 1e3 * std::sqrt(squares / static_cast<double>(points.Count()));
  const TriangleMesh warped{[&] {
                              Matrix3Xd vertices(3, from.NumVertices());
                              for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
                                vertices.col(i) = Warp(from.vertices.col(i));
                              }
                              return vertices;
                            }(),
                            from.faces};
  const TriangleTree tree(warped);
  const Matrix3Xd others = SampleSurface(to, kPoints);
  std::vector<double> missed;
  for (Eigen::Index i = 0; i < others.cols(); ++i) {
    missed.push_back(std::sqrt(tree.Closest(others.col(i)).squared_distance));
  }
  std::ranges::sort(missed);
  report_.missed_mm = 1e3 * missed[missed.size() * 95 / 100];

  const double step = 0.02 * BoxOf(from.vertices).Extent().norm();
  std::vector<double> stretch;
  double uniform = 0.0;
  for (Eigen::Index i = 0; i < points.Count(); i += kPoints / kStretched) {
    const Vector3d n = points.normal.col(i);
    const Vector3d u = n.unitOrthogonal(), v = n.cross(u);
    Eigen::Matrix<double, 3, 2> gradient;
    for (int k = 0; k < 2; ++k) {
      const Vector3d off = 0.5 * step * (k == 0 ? u : v);
      gradient.col(k) = (Warp(points.at.col(i) + off) - Warp(points.at.col(i) - off)) / step;
    }
    const Eigen::Vector2d squared =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(gradient.transpose() * gradient)
            .eigenvalues();
    for (const double s : {std::sqrt(std::max(1e-6, squared(0))), std::sqrt(squared(1))}) {
      stretch.push_back(std::log(std::max(1e-3, s)));
      uniform += stretch.back();
    }
  }
  uniform /= static_cast<double>(stretch.size());
  const auto ranked = [&](double offset, std::size_t percent) {
    std::vector<double> sizes;
    for (const double s : stretch) sizes.push_back(std::exp(std::abs(s - offset)));
    std::ranges::sort(sizes);
    return sizes[std::min(sizes.size() - 1, sizes.size() * percent / 100)];
  };
  report_.stretch_median = ranked(0.0, 50);
  report_.stretch_most = ranked(0.0, 95);
  const double size_mm = 1e3 * BoxOf(to.vertices).Extent().norm();
  report_.alike = report_.residual_mm < 0.04 * size_mm && report_.missed_mm < 0.08 * size_mm &&
                  ranked(uniform, 95) < 2.5;

  SetInPlace(from, to.vertices);
}

// Turned alike, the middles above each other, the lowest points level.
void SurfaceMap::SetInPlace(const TriangleMesh& from, const Matrix3Xd& to) {
  const Box a = BoxOf(from.vertices), b = BoxOf(rotation_.transpose() * to);
  Vector3d shift = b.Center() - a.Center();
  shift.z() = b.low.z() - a.low.z();
  to_from_from_ = RigidTransform(rotation_, rotation_ * shift);
}

SurfaceMap SurfaceMap::Scaled(const TriangleMesh& from, const Vector3d& factors) {
  if (!factors.allFinite() || (factors.array() < 0.05).any() || (factors.array() > 20.0).any()) {
    throw Error("scale", fmt::format("is {:g}, {:g}, {:g}", factors.x(), factors.y(), factors.z()),
                "Give one factor, or one for each axis, between 0.05 and 20");
  }
  SurfaceMap map;
  map.linear_ = factors.asDiagonal();
  map.report_.scale = factors;
  Vector3d stretch = factors.cwiseMax(factors.cwiseInverse());
  std::ranges::sort(stretch);
  map.report_.stretch_median = stretch(1);
  map.report_.stretch_most = stretch(2);
  map.SetInPlace(from, factors.asDiagonal() * from.vertices);
  return map;
}

SurfaceMap SurfaceMap::Registered(const TriangleMesh& from, const TriangleMesh& to,
                                  const SurfaceMapOptions& options) {
  SurfaceMap map = MapFinder(from, to, options).ByShape();
  map.Measure(from, to);
  return map;
}

SurfaceMap SurfaceMap::Given(const TriangleMesh& from, const TriangleMesh& to,
                             const Matrix3Xd& on_from, const Matrix3Xd& on_to,
                             const SurfaceMapOptions& options) {
  if (on_from.cols() != on_to.cols() || on_from.cols() < 4) {
    throw Error("map",
                fmt::format("has {} points on the first object and {} on the second",
                            on_from.cols(), on_to.cols()),
                "Give at least four pairs of points");
  }
  constexpr double kFarthest_m = 0.02;
  const std::pair<const TriangleMesh*, const Matrix3Xd*> sides[] = {{&from, &on_from},
                                                                    {&to, &on_to}};
  for (const auto& [mesh, points] : sides) {
    const TriangleTree tree(*mesh);
    for (Eigen::Index i = 0; i < points->cols(); ++i) {
      const double off = points->col(i).allFinite()
                             ? std::sqrt(tree.Closest(points->col(i)).squared_distance)
                             : std::numeric_limits<double>::infinity();
      if (off <= kFarthest_m) continue;
      throw Error("map",
                  fmt::format("pair {}: its point on the {} object is {:.3g} m off the surface", i,
                              mesh == &from ? "first" : "second", off),
                  "Give points of the surfaces in metres, in the objects' own frames");
    }
  }
  SurfaceMap map = MapFinder(from, to, options).ByPairs(on_from, on_to);
  map.Measure(from, to);
  return map;
}

SurfaceMap SurfaceMap::FromFile(const TriangleMesh& from, const TriangleMesh& to,
                                const std::filesystem::path& path,
                                const SurfaceMapOptions& options) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path)) {
    throw Error(path.string(), "cannot be read", "Give a text file of pairs of points");
  }
  std::vector<std::vector<double>> rows;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    line = line.substr(0, line.find('#'));
    std::ranges::replace(line, ',', ' ');
    std::istringstream text(line);
    std::vector<double> row;
    for (std::string word; text >> word;) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      if (end == word.c_str() || *end != '\0' || !std::isfinite(value)) {
        throw Error(path.string(), fmt::format("line {}: '{}' is no number", number, word),
                    "A row has six numbers (x y z on the first object, x y z on the second), or "
                    "one (a vertex of the second)");
      }
      row.push_back(value);
    }
    if (row.empty()) continue;
    if ((row.size() != 6 && row.size() != 1) ||
        row.size() != (rows.empty() ? row : rows[0]).size()) {
      throw Error(path.string(), fmt::format("line {} has {} numbers", number, row.size()),
                  "A row has six numbers (x y z on the first object, x y z on the second), or one "
                  "(a vertex of the second)");
    }
    rows.push_back(std::move(row));
  }
  const bool by_vertex = !rows.empty() && rows[0].size() == 1;
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (by_vertex && count != from.NumVertices()) {
    throw Error(path.string(),
                fmt::format("has {} rows, the first object {} vertices", count, from.NumVertices()),
                "Give a vertex of the second object for each vertex of the first");
  }
  Matrix3Xd on_from(3, count), on_to(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::vector<double>& row = rows[static_cast<std::size_t>(i)];
    if (!by_vertex) {
      on_from.col(i) << row[0], row[1], row[2];
      on_to.col(i) << row[3], row[4], row[5];
      continue;
    }
    if (row[0] != std::floor(row[0]) || row[0] < 0.0 ||
        row[0] >= static_cast<double>(to.NumVertices())) {
      throw Error(path.string(),
                  fmt::format("row {} names vertex {:g}, the second object has {}", i, row[0],
                              to.NumVertices()),
                  "Vertices count from 0");
    }
    on_from.col(i) = from.vertices.col(i);
    on_to.col(i) = to.vertices.col(static_cast<Eigen::Index>(row[0]));
  }
  return NamingSource("map", path.string(),
                      [&] { return Given(from, to, on_from, on_to, options); });
}

}  // namespace holdfast
