// SPDX-License-Identifier: MIT
#include "solver/transfer/map_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <utility>

#include <ceres/autodiff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <Eigen/Eigenvalues>

#include "geometry/rotation.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

constexpr int kMatched = 1500;  // points on each surface
constexpr int kNodes = 70;      // of the deformation graph

// Start rotations: about z, and between axes of inertia.
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

MapFinder::MapFinder(const TriangleMesh& from, const TriangleMesh& to) : from_surface_(from) {
  map_.to_ = std::make_shared<const SignedDistance>(to);
  from_ = SampleOriented(from, from_surface_, kMatched);
  to_ = SampleOriented(to, *map_.to_, kMatched);
  size_ = BoxOf(to.vertices).diagonal().norm();
  to_tree_.emplace(Lifted(to_));
}

SurfaceMap MapFinder::ByShape() {
  map_.report_.method = "registered";
  Align();
  MakeNodes();
  for (const double stiffness : {3.0, 1.0, 0.5, 0.25, 0.25}) BendToShape(stiffness);
  return std::move(map_);
}

SurfaceMap MapFinder::ByPairs(const Matrix3Xd& on_from, const Matrix3Xd& on_to) {
  map_.report_.method = "given";
  PlaceByPairs(on_from, on_to);
  MakeNodes();
  std::vector<Match> matches;
  for (Eigen::Index i = 0; i < on_from.cols(); ++i) {
    matches.push_back({map_.Placed(on_from.col(i)), on_to.col(i), Vector3d::Zero()});
  }
  for (int round = 0; round < 3; ++round) Bend(matches, 0.05);
  return std::move(map_);
}

Matrix3Xd MapFinder::Lifted(const OrientedPoints& points) const {
  return points.at + Lift() * points.normal;
}

void MapFinder::SetPlaced(const Matrix3d& turn, SurfaceMap& map) const {
  const Eigen::AlignedBox3d box_from = BoxOf(from_.at), box_to = BoxOf(turn.transpose() * to_.at);
  const Vector3d scale = box_to.diagonal().cwiseQuotient(box_from.diagonal().cwiseMax(1e-4));
  map.rotation_ = turn;
  map.report_.scale = scale;
  map.linear_ = turn * scale.asDiagonal();
  map.offset_ = turn * box_to.center() - map.linear_ * box_from.center();
}

OrientedPoints MapFinder::Moved(const SurfaceMap& map) const {
  OrientedPoints moved = from_;
  moved.at = (map.linear_ * from_.at).colwise() + map.offset_;
  moved.normal = map.rotation_ * map.report_.scale.cwiseInverse().asDiagonal() * from_.normal;
  moved.normal.colwise().normalize();
  return moved;
}

double MapFinder::Mismatch(const SurfaceMap& map, int stride) const {
  const Matrix3Xd moved = Lifted(Moved(map));
  const Matrix3Xd other = Lifted(to_);
  const Matrix3Xd some = moved(Eigen::all, Eigen::seq(0, Eigen::last, stride));
  const NearestPoints tree(some);
  const double most = 0.15 * size_;
  double sum = 0.0;
  for (Eigen::Index i = 0; i < some.cols(); ++i) {
    sum += std::pow(std::min(most, to_tree_->Nearest(some.col(i)).distance), 2);
    sum += std::pow(std::min(most, tree.Nearest(other.col(i * stride)).distance), 2);
  }
  return sum / static_cast<double>(2 * some.cols());
}

void MapFinder::Align() {
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

double MapFinder::Cost(double mismatch, const Matrix3d& turn) const {
  const double tilt = std::acos(std::clamp(turn(2, 2), -1.0, 1.0)) / std::numbers::pi;
  const double angle = LogSO3(turn).norm() / std::numbers::pi;
  return (mismatch + 1e-4 * size_ * size_) * (1.0 + 0.1 * tilt + 0.1 * angle);
}

Matrix3d MapFinder::Iterated(Matrix3d turn) {
  constexpr int kRounds = 8;
  for (int round = 0; round < kRounds; ++round) {
    SetPlaced(turn, map_);
    const OrientedPoints moved = Moved(map_);
    const Matrix3Xd lifted = Lifted(moved);
    const Vector3d center = BoxOf(moved.at).center();
    Matrix3d covariance = Matrix3d::Zero();
    for (Eigen::Index i = 0; i < lifted.cols(); i += 2) {
      const NearestPoints::Neighbor near = to_tree_->Nearest(lifted.col(i));
      if (near.distance > 0.15 * size_) continue;
      covariance += (to_.at.col(near.id) - center) * (moved.at.col(i) - center).transpose();
    }
    const Matrix3d step = NearestRotation(covariance);
    turn = step * turn;
    if (LogSO3(step).norm() < 0.2 * kDegree) break;
  }
  return NearestRotation(turn);
}

void MapFinder::PlaceByPairs(const Matrix3Xd& on_from, const Matrix3Xd& on_to) {
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

void MapFinder::MakeNodes() {
  const Matrix3Xd placed = (map_.linear_ * from_.at).colwise() + map_.offset_;
  Eigen::VectorXd distance =
      Eigen::VectorXd::Constant(placed.cols(), std::numeric_limits<double>::infinity());
  Eigen::Index next = 0;
  const int count = std::min<int>(kNodes, static_cast<int>(placed.cols()));
  for (int k = 0; k < count; ++k) {
    DeformationNode node;
    node.at = placed.col(next);
    map_.nodes_.push_back(node);
    distance = distance.cwiseMin((placed.colwise() - node.at).colwise().norm().transpose().eval());
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

void MapFinder::BendToShape(double stiffness) {
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
    const NearestPoints::Neighbor near = to_tree_->Nearest(lifted.col(i));
    if (near.distance > most || to_.normal.col(near.id).dot(bent.normal.col(i)) < 0.2) continue;
    matches.push_back({map_.Placed(from_.at.col(i)), to_.at.col(near.id), to_.normal.col(near.id)});
  }
  for (Eigen::Index j = 0; j < to_.Count(); ++j) {
    const NearestPoints::Neighbor near = tree.Nearest(lifted_to.col(j));
    if (near.distance > most || to_.normal.col(j).dot(bent.normal.col(near.id)) < 0.2) continue;
    matches.push_back({map_.Placed(from_.at.col(near.id)), to_.at.col(j), to_.normal.col(j)});
  }
  Bend(matches, stiffness);
}

void MapFinder::Bend(const std::vector<Match>& matches, double stiffness) {
  std::vector<std::array<double, 6>> unknowns(map_.nodes_.size());
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const Vector3d turn = LogSO3(map_.nodes_[k].turn);
    Eigen::Map<Vector3d>(unknowns[k].data()) = turn;
    Eigen::Map<Vector3d>(unknowns[k].data() + 3) = map_.nodes_[k].shift;
  }
  ceres::Problem problem;
  const double share = 1.0 / std::sqrt(std::max<double>(1.0, static_cast<double>(matches.size())));
  for (const Match& match : matches) {
    const NodeWeights near = WeightsAt(map_.nodes_, match.placed);
    std::array<Vector3d, kNodesOfPoint> nodes;
    for (int k = 0; k < kNodesOfPoint; ++k) nodes[k] = map_.nodes_[near.node[k]].at;
    const bool plane = !match.normal.isZero(0.0);
    auto* goal = new GoalOfPoint{match.placed,
                                 nodes,
                                 near.weight,
                                 match.goal,
                                 match.normal,
                                 plane ? share : 0.0,
                                 plane ? 0.3 * share : share};
    auto* cost = new ceres::AutoDiffCostFunction<GoalOfPoint, 4, 6, 6, 6, 6>(goal);
    problem.AddResidualBlock(cost, nullptr, unknowns[near.node[0]].data(),
                             unknowns[near.node[1]].data(), unknowns[near.node[2]].data(),
                             unknowns[near.node[3]].data());
  }
  const double rigid = std::sqrt(stiffness / static_cast<double>(edges_.size()));
  for (const auto& [k, l] : edges_) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RigidNeighbors, 3, 6, 6>(
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

}  // namespace holdfast
