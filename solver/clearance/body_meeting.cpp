// SPDX-License-Identifier: MIT
#include "solver/clearance/body_meeting.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "geometry/clip/clip.h"
#include "geometry/mesh/surface_distance.h"

namespace holdfast {
namespace {

constexpr int kMaxSamples = 300;    // at a spacing of 1 cm
constexpr double kDeepest_m = 0.1;  // greater depths are not recognized from outside
constexpr double kNearTable_m = 0.15;
constexpr int kClusterSize = 8;
constexpr std::uint8_t kBothArms = kHoldsRight | kHoldsLeft;

// Vertices about `spacing_m` apart in the rest pose.
std::vector<int> Thinned(const BodySurface& body, const std::vector<int>& vertices,
                         double spacing_m) {
  std::vector<int> kept;
  for (const int i : vertices) {
    const bool near = std::ranges::any_of(kept, [&](int k) {
      return (body.RestVertices().col(i) - body.RestVertices().col(k)).squaredNorm() <
             spacing_m * spacing_m;
    });
    if (!near) kept.push_back(i);
  }
  return kept;
}

double ShareOfHand(const BodySurface& body, int vertex, Side side) {
  double share = 0.0;
  for (const auto& [joint, weight] : body.Weights(vertex)) {
    const bool finger = joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand;
    if (finger || joint == WristJoint(side)) share += weight;
  }
  return share;
}

// Calls visit(i, skin) for the points that may be inside the skin or within `within_m` of it;
// `skin` is an upper bound on the distance of the skin.
template <typename Visit>
void ForEachNear(const OwnBody::Posed& skin, const Eigen::Matrix3Xd& points,
                 const std::vector<std::vector<int>>& clusters, double within_m,
                 const Visit& visit) {
  constexpr double kRounding_m = 1e-9;
  std::optional<OwnBody::Touch> last;
  for (const std::vector<int>& members : clusters) {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const int i : members) center += points.col(i);
    center /= static_cast<double>(members.size());
    double radius = 0.0;
    for (const int i : members) radius = std::max(radius, (points.col(i) - center).norm());
    // The skin nearest to one point bounds its distance from another by the triangle inequality.
    const auto touch =
        skin.Query(center, last ? (center - last->surface).norm() + kRounding_m : kDeepest_m);
    if (touch) last = touch;
    if (touch && -touch->depth > radius + within_m) continue;
    for (const int i : members) {
      visit(i, touch ? (points.col(i) - touch->surface).norm() + kRounding_m : kDeepest_m);
    }
  }
}

}  // namespace

std::string_view MeetingPartName(MeetingPart part) {
  constexpr const char* kNames[] = {"", "object", "right arm", "left arm"};
  return kNames[static_cast<std::size_t>(part)];
}

BodyCollisionDetector::BodyCollisionDetector(const BodySurface& body, const TriangleMesh& object,
                                             std::span<const std::uint8_t> left_out,
                                             double spacing_m)
    : body_(body) {
  obstacles_[kBothArms].emplace(body, kBothArms);
  for (const std::uint8_t bits : left_out) {
    if (!obstacles_[bits & 3]) obstacles_[bits & 3].emplace(body, bits);
  }
  LookAt(object, spacing_m);
}

void BodyCollisionDetector::LookAt(const TriangleMesh& object, double spacing_m) {
  object_ = ContactSamples(object, spacing_m,
                           static_cast<int>(kMaxSamples * 1e-4 / (spacing_m * spacing_m)));
  object_clusters_ = Clustered(object_);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const int a = side == Side::kRight ? 0 : 1;
    skin_[a] = Thinned(body_, OwnBody::ForearmAndHand(body_, side), spacing_m);
    share_[a].clear();
    for (const int i : skin_[a]) share_[a].push_back(ShareOfHand(body_, i, side));
    skin_clusters_[a] = Clustered(body_.RestVertices()(Eigen::all, skin_[a]));
  }
}

void BodyCollisionDetector::AddTable(const TriangleMesh& mesh,
                                     const Eigen::Isometry3d& world_from_table) {
  constexpr double kTop_m = 0.05, kThick_m = 0.12;
  const double height = mesh.vertices.row(2).maxCoeff();
  TableTop& top = table_.emplace();
  top.world_from_table = world_from_table;
  for (const auto& vertex : mesh.vertices.colwise()) {
    if (vertex.z() > height - kTop_m) top.box.extend(Eigen::Vector3d(vertex));
  }
  top.box.min().z() = height - kThick_m;
}

std::optional<OwnBody::Touch> BodyCollisionDetector::TableTop::Query(
    const Eigen::Vector3d& point) const {
  const Eigen::Vector3d at = world_from_table.inverse() * point;
  if (at.z() < box.min().z()) return std::nullopt;
  OwnBody::Touch touch;
  Eigen::Vector3d nearest = at.cwiseMax(box.min()).cwiseMin(box.max());
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  if (nearest == at) {
    touch.depth = box.max().z() - at.z();
    nearest.z() = box.max().z();
    for (const int axis : {0, 1}) {
      for (const double end : {box.min()(axis), box.max()(axis)}) {
        const double depth = std::abs(at(axis) - end);
        if (depth >= touch.depth) continue;
        touch.depth = depth;
        nearest = at;
        nearest(axis) = end;
        normal = Eigen::Vector3d::Unit(axis) * (end < box.center()(axis) ? -1.0 : 1.0);
      }
    }
  } else {
    touch.depth = -(at - nearest).norm();
    normal = (at - nearest).normalized();
  }
  touch.surface = world_from_table * nearest;
  touch.normal = world_from_table.linear() * normal;
  return touch;
}

OwnBody::Touch BodyCollisionDetector::InObject(const Eigen::Isometry3d& world_from_object,
                                               const Eigen::Vector3d& point) const {
  OwnBody::Touch touch;
  Eigen::Vector3d gradient;
  touch.depth = -distance_->Distance(world_from_object.inverse() * point, &gradient);
  touch.normal = world_from_object.linear() * gradient.stableNormalized();
  touch.surface = point + touch.depth * touch.normal;
  return touch;
}

BodyCollisionDetector::Clusters BodyCollisionDetector::Clustered(const Eigen::Matrix3Xd& points) {
  Clusters clusters;
  std::vector<int> order(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  const auto split = [&](const auto& self, auto begin, auto end) -> void {
    if (begin == end) return;
    if (end - begin <= kClusterSize) {
      clusters.emplace_back(begin, end);
      return;
    }
    Eigen::AlignedBox3d box;
    for (auto i = begin; i != end; ++i) box.extend(points.col(*i));
    Eigen::Index axis;
    box.sizes().maxCoeff(&axis);
    const auto middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end, [&](int a, int b) {
      return std::pair(points(axis, a), a) < std::pair(points(axis, b), b);
    });
    self(self, begin, middle);
    self(self, middle, end);
  };
  split(split, order.begin(), order.end());
  return clusters;
}

BodyCollisionDetector::Frame BodyCollisionDetector::Measure(
    const BodyState& state, const Eigen::Isometry3d& world_from_object, std::uint8_t arms,
    std::uint8_t left_out, double within_m) const {
  Frame frame;
  const auto search = [&](std::uint8_t obstacle, bool with_object, std::uint8_t of) {
    Eigen::Matrix3Xd object(3, 0);
    if (with_object) object = world_from_object * object_;
    std::array<Eigen::Matrix3Xd, 2> skin;
    Eigen::AlignedBox3d box;
    for (const auto& point : object.colwise()) box.extend(point);
    for (int a = 0; a < 2; ++a) {
      if ((of & (1 << a)) == 0) continue;
      skin[a] = state.vertices(Eigen::all, skin_[a]);
      for (const auto& point : skin[a].colwise()) box.extend(point);
    }
    if (box.isEmpty()) return;
    const auto add = [&](const Point& point, int arm) {
      if (point.touch.depth < -within_m) return;
      frame.near[arm].push_back(point);
      frame.nearest_m = std::max(frame.nearest_m, point.touch.depth);
      frame.arm_depth_m[arm] = std::max(frame.arm_depth_m[arm], point.touch.depth);
      frame.depth_m = std::max(frame.depth_m, point.touch.depth);
    };
    const int holding = (arms & 1) != 0 ? 0 : 1;
    if (table_) {
      for (const auto& at : object.colwise()) {
        const auto touch = table_->Query(at);
        if (!touch) continue;
        add({at, *touch, 1.0, true}, holding);
        frame.near_table[holding] |= touch->depth > -kNearTable_m;
      }
      for (int a = 0; a < 2; ++a) {
        for (Eigen::Index i = 0; i < skin[a].cols(); ++i) {
          const auto touch = table_->Query(skin[a].col(i));
          if (!touch) continue;
          add({skin[a].col(i), *touch, share_[a][i]}, a);
          frame.near_table[a] |= touch->depth > -kNearTable_m;
        }
      }
    }
    for (int a = 0; a < 2 && distance_ != nullptr; ++a) {
      if ((arms & (1 << a)) != 0) continue;
      for (Eigen::Index i = 0; i < skin[a].cols(); ++i) {
        const Eigen::Vector3d at = skin[a].col(i);
        const OwnBody::Touch touch = InObject(world_from_object, at);
        if (touch.depth < -within_m) continue;
        frame.near[a].push_back({at, touch, share_[a][i], true});
        frame.nearest_m = std::max(frame.nearest_m, touch.depth);
        frame.in_object_m[a] = std::max(frame.in_object_m[a], touch.depth);
      }
    }
    const OwnBody::Posed body(*obstacles_[obstacle], state.vertices, box.min(), box.max(),
                              kDeepest_m);
    const auto look = [&](const Eigen::Vector3d& at, double skin_m, int arm, double share,
                          bool may_touch) {
      if (const auto touch = body.Query(at, skin_m)) add({at, *touch, share, may_touch}, arm);
    };
    if (with_object) {
      ForEachNear(body, object, object_clusters_, within_m, [&](int i, double skin_m) {
        look(object.col(i), skin_m, holding, 1.0, at_lips_);
      });
    }
    for (int a = 0; a < 2; ++a) {
      if ((of & (1 << a)) == 0) continue;
      ForEachNear(body, skin[a], skin_clusters_[a], within_m, [&](int i, double skin_m) {
        look(skin[a].col(i), skin_m, a, share_[a][i], false);
      });
    }
  };
  search(left_out, arms != 0, left_out);
  search(kBothArms, false, kBothArms & ~left_out);
  return frame;
}

namespace {

ArmChange Blend(double const* const* knots, const Eigen::Vector4d& basis) {
  ArmChange change = ArmChange::Zero();
  for (int k = 0; k < 4; ++k) change += basis(k) * Eigen::Map<const ArmChange>(knots[k]);
  return change;
}

void Spread(const ArmRows& J, const Eigen::Vector4d& basis, double** jacobians) {
  for (int k = 0; k < 4; ++k) {
    if (jacobians[k] != nullptr) Eigen::Map<ArmRows>(jacobians[k], J.rows(), 12) = basis(k) * J;
  }
}

}  // namespace

ClearanceBlock::ClearanceBlock(const ArmFrame& frame, DepthInBody depth, const HandStay& stay,
                               const ArmRange& range, const Eigen::Vector4d& basis)
    : frame_(frame), depth_(std::move(depth)), stay_(stay), range_(range), basis_(basis) {
  set_num_residuals(depth_.Rows() + HandStay::kRows + ArmRange::kRows);
  mutable_parameter_block_sizes()->assign(4, 12);
}

bool ClearanceBlock::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  const ArmChange change = Blend(parameters, basis_);
  ArmState state;
  state.Evaluate(frame_, change);
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  ArmRows J(num_residuals(), 12);
  const int n = depth_.Rows();
  depth_.Evaluate(state, r.head(n), J.topRows(n));
  stay_.Evaluate(state, r.segment<HandStay::kRows>(n), J.middleRows<HandStay::kRows>(n));
  range_.Evaluate(change, r.tail<ArmRange::kRows>(), J.bottomRows<ArmRange::kRows>());
  if (jacobians != nullptr) Spread(J, basis_, jacobians);
  return true;
}

ClosureBlock::ClosureBlock(const ArmFrame& right, const ArmFrame& left, const HandClosure& closure,
                           const Eigen::Vector4d& basis)
    : right_(right), left_(left), closure_(closure), basis_(basis) {
  set_num_residuals(HandClosure::kRows);
  mutable_parameter_block_sizes()->assign(8, 12);
}

bool ClosureBlock::Evaluate(double const* const* parameters, double* residuals,
                            double** jacobians) const {
  ArmState right, left;
  right.Evaluate(right_, Blend(parameters, basis_));
  left.Evaluate(left_, Blend(parameters + 4, basis_));
  Eigen::Map<Eigen::Matrix<double, HandClosure::kRows, 1>> r(residuals);
  ArmRows J_right(HandClosure::kRows, 12), J_left(HandClosure::kRows, 12);
  closure_.Evaluate(right, left, r, J_right, J_left);
  if (jacobians == nullptr) return true;
  Spread(J_right, basis_, jacobians);
  Spread(J_left, basis_, jacobians + 4);
  return true;
}

}  // namespace holdfast
