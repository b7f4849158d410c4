// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "geometry/rotation.h"
#include "solver/robot/hand_correspondence.h"
#include "solver/robot/robot_solids.h"
#include "solver/robot/robot_term.h"
#include "solver/terms/hand/paper_terms.h"

namespace holdfast {

/// Contact of a part of the human hand with the object.
struct PartContact {
  int part = 0;                                      ///< 15 phalanges, then the palm
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< on the object's surface, object's frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outward unit normal of the object
  double weight = 1.0;
};

/// Contact term: the robot's pad touches what the corresponding human part touched, face to face,
///
///   E_c = sum_c w_c ( |x - p_c|^2 / sigma_d^2 + |m + n_c|^2 / sigma_n^2 )
///
/// x and m are position and outward normal of the pad point that is currently best for the contact
/// (by both measures together: the pad may roll), p_c and n_c those of the object. Object's frame,
/// meters; 3 + 3 residuals per contact. Weights: sigma_d (meters) and sigma_n (radians).
class RobotContactTerm final : public RobotTerm {
 public:
  RobotContactTerm(const RobotPads& pads, std::vector<PartContact> contacts, double sigma_m,
                   double sigma_turn)
      : pads_(pads),
        contacts_(std::move(contacts)),
        by_place_(1.0 / (sigma_m * sigma_m)),
        by_turn_(1.0 / (sigma_turn * sigma_turn)) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    for (const PartContact& contact : contacts_) {
      double least = 0.0;
      const std::optional<PadPoint> pad = pads_.BestFacing(
          contact.part, robot, contact.point, contact.normal, by_place_, by_turn_, &least);
      if (!pad) continue;
      cost += 0.5 * contact.weight * least;
      if (normal == nullptr) continue;
      const Eigen::Isometry3d& pose = robot.ObjectFromLink(pad->link);
      const Eigen::Vector3d x = pose * pad->point;
      const Eigen::Vector3d m = pose.linear() * pad->normal;
      const double d = contact.weight * by_place_, t = contact.weight * by_turn_;
      normal->AddPoint(pad->link, x, d * (x - contact.point), d * Eigen::Matrix3d::Identity());
      normal->AddTurn(pad->link, t * m.cross(contact.normal),
                      t * (Eigen::Matrix3d::Identity() - m * m.transpose()));
    }
    return cost;
  }

 private:
  const RobotPads& pads_;
  std::vector<PartContact> contacts_;
  double by_place_, by_turn_;
};

/// Touch term: pads that are near the object touch it, also where the human hand does not. More
/// contacts bear a load.
///
///   E_t = 1/2 sum_p d_p^2 / (1 + d_p^2 / c^2) / sigma^2
///
/// d_p is the distance of the pad point of part p that is nearest to the object, 0 inside, at most
/// 2 cm. Geman-McClure loss of scale c (`reach_m`): far pads are not pulled. Meters; one residual
/// per part. Weight: sigma.
class RobotTouchTerm final : public RobotTerm {
 public:
  RobotTouchTerm(const RobotPads& pads, const DistanceGrid& object, std::vector<int> parts,
                 double sigma_m, double reach_m)
      : pads_(pads),
        object_(object),
        parts_(std::move(parts)),
        weight_(1.0 / sigma_m),
        reach_(reach_m) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    constexpr double kFar_m = 0.02;
    double cost = 0.0;
    for (const int part : parts_) {
      const std::optional<PadPoint> pad = pads_.Touching(part, robot, object_, kFar_m);
      Eigen::Vector3d x, gradient;
      double d = kFar_m;
      if (pad) {
        x = robot.ObjectFromLink(pad->link) * pad->point;
        d = std::clamp(object_.Distance(x, &gradient), 0.0, kFar_m);
      }
      const double share = 1.0 / (1.0 + d * d / (reach_ * reach_));
      cost += 0.5 * weight_ * weight_ * d * d * share;
      if (normal == nullptr || d == 0.0 || d == kFar_m) continue;
      normal->AddPointRow(pad->link, x, share * weight_ * gradient, share * weight_ * d);
    }
    return cost;
  }

 private:
  const RobotPads& pads_;
  const DistanceGrid& object_;
  std::vector<int> parts_;
  double weight_, reach_;
};

/// E_d on the interaction mesh: the robot's skin preserves the distances of the human's skin to the
/// object in this frame (IMoS, Ghosh et al. 2023, eq. 7; between two hands as in OmniRetarget, Yang
/// et al. 2025, whose Laplacian uses the same edges),
///
///   E_d = sum_i w_i / M sum_j ( |x_i(pose) - o_j| - |v_i - o_j| )^2 / sigma^2
///
/// x_i is the robot's point, v_i the corresponding human point, o_j the M object points; all in the
/// object's frame, meters. Summed exactly to 3 x 3 per point (HandObjectDistance), then to 6 x 6
/// per link. Weights: w_i, 1 at the surface.
class RobotDistanceTerm final : public RobotTerm {
 public:
  /// `human` (3 x n): v_i of each pair.
  RobotDistanceTerm(const std::vector<SkinPair>& pairs, const Eigen::Matrix3Xd& human,
                    const Eigen::Matrix3Xd& object, Eigen::VectorXd weights, double sigma_m)
      : pairs_(pairs),
        distances_(object, HandObjectDistance::Distances(human, object),
                   1.0 / (sigma_m * sigma_m * static_cast<double>(object.cols()))),
        weights_(std::move(weights)),
        x_(3, human.cols()),
        sums_(pairs.size()) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      x_.col(i) = robot.ObjectFromLink(pairs_[i].link) * pairs_[i].point;
      sums_[i] = {Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero(), 0.0};
    }
    distances_.Add(x_, sums_);
    double cost = 0.0;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      cost += weights_(k) * sums_[i].cost;
      if (normal == nullptr) continue;
      normal->AddPoint(pairs_[i].link, x_.col(k), weights_(k) * sums_[i].gradient,
                       weights_(k) * sums_[i].hessian);
    }
    return cost;
  }

 private:
  const std::vector<SkinPair>& pairs_;
  HandObjectDistance distances_;
  Eigen::VectorXd weights_;
  mutable Eigen::Matrix3Xd x_;  // scratch
  mutable std::vector<VertexQuadratic> sums_;
};

/// Self-collision: penalizes points of one link in another, as RobotPenetrationTerm, over the pairs
/// that may collide (RobotSolids::Pairs). Meters; weight: sigma.
class RobotSelfTerm final : public RobotTerm {
 public:
  RobotSelfTerm(const RobotSolids& solids, double sigma_m)
      : solids_(solids), weight_(1.0 / sigma_m), near_(2 * solids.Pairs().size()) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    for (std::size_t k = 0; k < solids_.Pairs().size(); ++k) {
      const auto& [a, b] = solids_.Pairs()[k];
      const Eigen::Vector3d between = robot.ObjectFromLink(a) * solids_.Of(a).center -
                                      robot.ObjectFromLink(b) * solids_.Of(b).center;
      const double reach = solids_.Of(a).radius + solids_.Of(b).radius;
      if (between.squaredNorm() > reach * reach) continue;
      cost += AddInto(robot, a, b, near_[2 * k], normal) +
              AddInto(robot, b, a, near_[2 * k + 1], normal);
    }
    return cost;
  }

 private:
  // Points of `first` in `second`.
  double AddInto(const PosedRobot& robot, int first, int second, NearSamples& near,
                 RobotNormal* normal) const {
    const LinkSolid &from = solids_.Of(first), &into = solids_.Of(second);
    const Eigen::Isometry3d& pose = robot.ObjectFromLink(second);
    double cost = 0.0;
    near.ForNear(from.samples, from.center, from.radius, *into.grid,
                 pose.inverse() * robot.ObjectFromLink(first), 0.0,
                 [&](int, const Eigen::Vector3d& in_second) {
                   Eigen::Vector3d gradient;
                   const double r = -weight_ * into.grid->Distance(in_second, &gradient);
                   if (r <= 0.0) return;
                   cost += 0.5 * r * r;
                   if (normal == nullptr) return;
                   normal->AddBetween(first, second, pose * in_second,
                                      -weight_ * (pose.linear() * gradient), r);
                 });
    return cost;
  }

  const RobotSolids& solids_;
  double weight_;
  mutable std::vector<NearSamples> near_;  // both directions of each pair
};

/// Joint limits as penalties: r_k = (low - q) / sigma below, (q - high) / sigma above. Radians (or
/// meters) of each degree of freedom; weight: sigma. The remaining violation is clamped.
class RobotLimitTerm final : public RobotTerm {
 public:
  explicit RobotLimitTerm(double sigma) : weight_(1.0 / (sigma * sigma)) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    const auto& dofs = robot.Hand().dofs;
    for (int k = 0; k < robot.Hand().NumDofs(); ++k) {
      const double q = robot.Pose().q(k);
      const double over = q - std::clamp(q, dofs[k].low, dofs[k].high);
      if (over == 0.0) continue;
      cost += 0.5 * weight_ * over * over;
      if (normal != nullptr) normal->AddNumber(k, weight_ * over, weight_);
    }
    return cost;
  }

 private:
  double weight_;
};

/// Keeps joint values near a target (the previous frame, or rest): r_k = (q_k - target_k) /
/// sigma_k. Radians or meters.
class RobotPostureTerm final : public RobotTerm {
 public:
  RobotPostureTerm(Eigen::VectorXd target, Eigen::VectorXd sigma)
      : target_(std::move(target)), weight_(sigma.cwiseAbs2().cwiseInverse()) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    const Eigen::VectorXd off = robot.Pose().q - target_;
    if (normal != nullptr) {
      for (Eigen::Index k = 0; k < off.size(); ++k) {
        normal->AddNumber(static_cast<int>(k), weight_(k) * off(k), weight_(k));
      }
    }
    return 0.5 * off.cwiseAbs2().dot(weight_);
  }

 private:
  Eigen::VectorXd target_, weight_;
};

/// Keeps the root near a target pose (the previous frame, or the human wrist): six residuals,
/// log(R_target^T R) / sigma_turn (radians) and the displacement of the point `center` of the
/// root's frame / sigma (meters), so that rotation about it causes no displacement.
class RobotPlaceTerm final : public RobotTerm {
 public:
  RobotPlaceTerm(Eigen::Isometry3d object_from_root, Eigen::Vector3d center, double sigma_turn,
                 double sigma_m)
      : target_(std::move(object_from_root)),
        center_(std::move(center)),
        turn_weight_(1.0 / (sigma_turn * sigma_turn)),
        weight_(1.0 / (sigma_m * sigma_m)) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    const RobotPose& pose = robot.Pose();
    const Eigen::Vector3d turn = LogSO3(target_.linear().transpose() * pose.R);
    const Eigen::Vector3d way = pose.R * center_ + pose.T - target_ * center_;
    if (normal != nullptr) {
      // R exp(delta): log changes by the inverse right Jacobian, i.e. the left Jacobian of -log.
      const Eigen::Matrix3d J_turn = InverseLeftJacobianSO3(-turn);
      Eigen::Matrix<double, 3, 6> J_way;
      J_way << -pose.R * Skew(center_), Eigen::Matrix3d::Identity();
      Eigen::Matrix<double, 6, 6> hessian = weight_ * J_way.transpose() * J_way;
      Eigen::Matrix<double, 6, 1> gradient = weight_ * J_way.transpose() * way;
      hessian.topLeftCorner<3, 3>() += turn_weight_ * J_turn.transpose() * J_turn;
      gradient.head<3>() += turn_weight_ * J_turn.transpose() * turn;
      normal->AddBase(gradient, hessian);
    }
    return 0.5 * (turn_weight_ * turn.squaredNorm() + weight_ * way.squaredNorm());
  }

 private:
  Eigen::Isometry3d target_;
  Eigen::Vector3d center_;
  double turn_weight_, weight_;
};

/// Penetration in both directions: points of the links in the object, and points of the object in
/// the links,
///
///   E_p = sum_i max(0, margin - d(x_i))^2 / sigma^2
///
/// d is the signed distance (negative inside) of the other solid. Meters; one residual per point
/// closer than the margin. Weight: sigma. Not thread-safe.
class RobotPenetrationTerm final : public RobotTerm {
 public:
  /// `samples`: surface points of the object.
  RobotPenetrationTerm(const RobotSolids& solids, const DistanceGrid& object,
                       const Eigen::Matrix3Xd& samples, double margin_m, double sigma_m)
      : solids_(solids),
        object_(object),
        samples_(samples),
        margin_(margin_m),
        weight_(1.0 / sigma_m),
        near_(solids.Links().size()) {}

  /// For solves that start with a loose penalty.
  void SetSigma(double sigma_m) { weight_ = 1.0 / sigma_m; }

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    ForNearLinks(robot, [&](int link, const LinkSolid& solid, const Eigen::Isometry3d& pose,
                            Near& near) {
      cost += AddLink(link, solid, pose, near, normal) + AddObject(link, solid, pose, near, normal);
    });
    return cost;
  }

  /// Maximum depth of all points, meters; 0 if none is inside. Linearly interpolated distances.
  double Deepest(const PosedRobot& robot) const {
    double deepest = 0.0;
    ForNearLinks(robot,
                 [&](int, const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near) {
                   ForLinkPoints(solid, pose, near, [&](const Eigen::Vector3d& x) {
                     deepest = std::max(deepest, -object_.Linear(x));
                   });
                   ForObjectPoints(solid, pose, near, [&](int, const Eigen::Vector3d& in_link) {
                     deepest = std::max(deepest, -solid.grid->Linear(in_link));
                   });
                 });
    return deepest;
  }

 private:
  static constexpr double kNear_m = 0.004;  // range that is examined in detail
  struct Near {
    NearSamples of_link, of_object;
  };

  template <typename Visit>
  void ForNearLinks(const PosedRobot& robot, const Visit& visit) const {
    for (std::size_t k = 0; k < solids_.Links().size(); ++k) {
      const int link = solids_.Links()[k];
      const LinkSolid& solid = solids_.Of(link);
      const Eigen::Isometry3d& pose = robot.ObjectFromLink(link);
      if (object_.Linear(pose * solid.center) > solid.radius + margin_ + kNear_m) continue;
      visit(link, solid, pose, near_[k]);
    }
  }

  // Visits the link's points that may be in the object, in the object's frame.
  template <typename Visit>
  void ForLinkPoints(const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near,
                     const Visit& visit) const {
    near.of_link.ForNear(solid.samples, solid.center, solid.radius, object_, pose, margin_,
                         [&](int, const Eigen::Vector3d& x) { visit(x); });
  }

  // Visits the object's points that may be in the link, in the link's frame.
  template <typename Visit>
  void ForObjectPoints(const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near,
                       const Visit& visit) const {
    near.of_object.ForNear(samples_, pose * solid.center, solid.radius + NearSamples::kAround_m,
                           *solid.grid, pose.inverse(), margin_,
                           [&](int j, const Eigen::Vector3d& in_link) {
                             if (InBox(*solid.grid, in_link)) visit(j, in_link);
                           });
  }

  double AddLink(int link, const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near,
                 RobotNormal* normal) const {
    double cost = 0.0;
    ForLinkPoints(solid, pose, near, [&](const Eigen::Vector3d& x) {
      Eigen::Vector3d gradient;
      const double r = weight_ * (margin_ - object_.Distance(x, &gradient));
      if (r <= 0.0) return;
      cost += 0.5 * r * r;
      if (normal != nullptr) normal->AddPointRow(link, x, -weight_ * gradient, r);
    });
    return cost;
  }

  // The link moves at a fixed object point: the derivative changes sign.
  double AddObject(int link, const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near,
                   RobotNormal* normal) const {
    double cost = 0.0;
    ForObjectPoints(solid, pose, near, [&](int j, const Eigen::Vector3d& in_link) {
      Eigen::Vector3d gradient;
      const double r = weight_ * (margin_ - solid.grid->Distance(in_link, &gradient));
      if (r <= 0.0) return;
      cost += 0.5 * r * r;
      if (normal == nullptr) return;
      normal->AddPointRow(link, samples_.col(j), weight_ * (pose.linear() * gradient), r);
    });
    return cost;
  }

  static bool InBox(const DistanceGrid& grid, const Eigen::Vector3d& x) {
    return (x.array() > grid.Min().array()).all() && (x.array() < grid.Max().array()).all();
  }

  const RobotSolids& solids_;
  const DistanceGrid& object_;
  const Eigen::Matrix3Xd& samples_;
  double margin_, weight_;
  mutable std::vector<Near> near_;  // by RobotSolids::Links
};

}  // namespace holdfast
