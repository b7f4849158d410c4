// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>

#include "geometry/rotation.h"
#include "solver/unknowns/free_pose.h"

namespace holdfast {

/// A shape and a pose's freedom that the terms of all frames share.
struct MarkedBody {
  FreePose free;
  Eigen::Matrix3Xd rest_joints;  ///< (3 x 55) at betas zero, metres
  Eigen::MatrixXd J_rest;        ///< d rest joints / d betas (165 x B)
  std::vector<int> joint;        ///< that each of M markers follows

  int NumShape() const { return static_cast<int>(J_rest.cols()); }
  int NumMarkers() const { return static_cast<int>(joint.size()); }
  Eigen::Matrix3Xd RestJoints(const double* betas) const {
    Eigen::Matrix3Xd joints = rest_joints;
    Eigen::Map<Eigen::VectorXd>(joints.data(), joints.size()) +=
        J_rest * Eigen::Map<const Eigen::VectorXd>(betas, J_rest.cols());
    return joints;
  }
};

/// Markers seen in a frame.
struct SeenMarkers {
  std::vector<int> marker;      ///< of the M
  Eigen::Matrix3Xd place;       ///< world, metres
  std::vector<double> sigma_m;  ///< one standard deviation of each

  int Count() const { return static_cast<int>(marker.size()); }
  void Add(int m, const Eigen::Vector3d& at, double sigma) {
    marker.push_back(m);
    place.conservativeResize(3, Count());
    place.col(Count() - 1) = at;
    sigma_m.push_back(sigma);
  }
};

/// The markers of a frame by the joint that they follow.
inline std::vector<SeenMarkers> ByJoint(const MarkedBody& body, const SeenMarkers& seen) {
  std::vector<SeenMarkers> groups;
  for (int k = 0; k < seen.Count(); ++k) {
    const int joint = body.joint[seen.marker[k]];
    auto group = std::ranges::find_if(
        groups, [&](const SeenMarkers& g) { return body.joint[g.marker[0]] == joint; });
    if (group == groups.end()) group = groups.emplace(groups.end());
    group->Add(seen.marker[k], seen.place.col(k), seen.sigma_m[k]);
  }
  return groups;
}

/// Markers of one joint are where the body carries them (Loper et al. 2014, eq. 4), far ones count
/// little:
///
///   r_k = g(|d_k|) d_k / sigma_k,  d_k = p_j + R_j x_k - m_k,  g(s) = c sqrt(log(1 + s^2/c^2)) / s
///
/// 3 residuals a seen marker, metres over metres; |r|^2 is Cauchy's loss with scale c. p, R: joint
/// j that the markers follow; x_k the place of each in its frame. Blocks, as Blocks() has them: root
/// (6), what is free on the way from the joint to the root (3 a joint, then a hand's numbers),
/// betas (B), the place of each marker (3).
class MarkerDistance final : public ceres::CostFunction {
 public:
  /// Markers that follow the same joint, one or more. `body` must outlive it.
  MarkerDistance(const MarkedBody& body, SeenMarkers seen, double scale_m)
      : body_(body), seen_(std::move(seen)), scale_(scale_m) {
    set_num_residuals(3 * seen_.Count());
    std::vector<int>& sizes = *mutable_parameter_block_sizes();
    sizes.push_back(FreePose::kRootSize);
    for (int a = body.joint[seen_.marker[0]]; a > 0; a = kJointParents[a]) chain_.push_back({a});
    std::ranges::reverse(chain_);
    for (Link& link : chain_) {
      link.column = body.free.Column(link.joint);
      if (link.column < 0) continue;
      link.block = static_cast<int>(sizes.size());
      sizes.push_back(3);
    }
    for (const FreePose::Hand& hand : body.free.Hands()) {
      for (Link& link : chain_) {
        const int finger = link.joint - HandBegin(hand.side);
        if (finger < 0 || finger >= kJointsPerHand) continue;
        hand_ = &hand;
        link.finger = finger;
        link.block = static_cast<int>(sizes.size());
      }
    }
    if (hand_ != nullptr) sizes.push_back(static_cast<int>(hand_->synergies.cols()));
    betas_ = static_cast<int>(sizes.size());
    sizes.push_back(body.NumShape());
    sizes.insert(sizes.end(), seen_.marker.size(), 3);
  }

  /// Where the blocks are in root (6), q (n), betas (B) and places (3 M).
  std::vector<double*> Blocks(double* root, double* q, double* betas, double* places) const {
    std::vector<double*> blocks = {root};
    for (const Link& link : chain_) {
      if (link.column >= 0) blocks.push_back(q + link.column);
    }
    if (hand_ != nullptr) blocks.push_back(q + hand_->column);
    blocks.push_back(betas);
    for (const int marker : seen_.marker) blocks.push_back(places + 3 * marker);
    return blocks;
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    Posed at[kMaxLinks + 1];
    Pose(x, J != nullptr, at);
    const Eigen::Matrix3d& R = at[chain_.size()].rotation;
    const Eigen::Vector3d& p = at[chain_.size()].place;
    for (std::size_t b = 0; J != nullptr && b < parameter_block_sizes().size(); ++b) {
      if (J[b] != nullptr) Rows(J, static_cast<int>(b), 0, seen_.Count()).setZero();
    }
    Eigen::Matrix<double, 3, Eigen::Dynamic> by_shape;
    if (J != nullptr && J[betas_] != nullptr) by_shape = ShapeJacobian(at);
    for (int k = 0; k < seen_.Count(); ++k) {
      const Eigen::Map<const Eigen::Vector3d> in_joint(x[betas_ + 1 + k]);
      const Eigen::Vector3d world = p + R * in_joint;
      const Eigen::Vector3d d = world - seen_.place.col(k);
      const auto [g, slope] = Robust(d.norm());
      Eigen::Map<Eigen::Vector3d>(residuals + 3 * k) = g * d / seen_.sigma_m[k];
      if (J == nullptr) continue;
      // d (g d) = (g I + g'/s d d^T) dd.
      const Eigen::Matrix3d weight =
          (g * Eigen::Matrix3d::Identity() + slope * d * d.transpose()) / seen_.sigma_m[k];
      const auto turn = [&](const Posed& joint) -> Eigen::Matrix3d {
        return -weight * Skew<double>(world - joint.place) * joint.turn;
      };
      if (J[0] != nullptr) Rows(J, 0, k, 1) << weight, turn(at[0]);
      for (std::size_t l = 0; l < chain_.size(); ++l) {
        const Link& link = chain_[l];
        if (link.block < 0 || J[link.block] == nullptr) continue;
        if (link.finger < 0) {
          Rows(J, link.block, k, 1) = turn(at[l + 1]);
        } else {
          Rows(J, link.block, k, 1) +=
              turn(at[l + 1]) * hand_->synergies.middleRows<3>(3 * link.finger);
        }
      }
      if (J[betas_] != nullptr) Rows(J, betas_, k, 1) = weight * by_shape;
      if (J[betas_ + 1 + k] != nullptr) Rows(J, betas_ + 1 + k, k, 1) = weight * R;
    }
    return true;
  }

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  // From the root to the fingertips.
  static constexpr std::size_t kMaxLinks = 12;

  struct Link {
    int joint;
    int column = -1;  // of its three numbers in q
    int finger = -1;  // number of a finger's joint in its hand
    int block = -1;   // parameter block; none at rest
  };
  // A joint of the chain; `turn`: its rotation vector in the world by its axis-angle.
  struct Posed {
    Eigen::Matrix3d rotation, turn;
    Eigen::Vector3d place;
  };

  Eigen::Map<RowMajor> Rows(double** J, int block, int marker, int markers) const {
    const int columns = parameter_block_sizes()[block];
    return {J[block] + 3 * marker * columns, 3 * markers, columns};
  }

  Eigen::Vector3d RestJoint(int joint, const double* betas) const {
    return body_.rest_joints.col(joint) +
           body_.J_rest.middleRows<3>(3 * joint) *
               Eigen::Map<const Eigen::VectorXd>(betas, body_.NumShape());
  }

  void Pose(double const* const* x, bool with_turns, Posed* at) const {
    const Eigen::Map<const Eigen::Vector3d> shift(x[0]), root(x[0] + 3);
    Eigen::Vector3d rest = RestJoint(0, x[betas_]);
    at[0].place = rest + shift;
    at[0].rotation = ExpSO3(root);
    if (with_turns) at[0].turn = LeftJacobianSO3(root);
    for (std::size_t l = 0; l < chain_.size(); ++l) {
      const Link& link = chain_[l];
      Eigen::Vector3d angles = body_.free.Rest().col(link.joint);
      if (link.finger >= 0) {
        angles += hand_->synergies.middleRows<3>(3 * link.finger) *
                  Eigen::Map<const Eigen::VectorXd>(x[link.block], hand_->synergies.cols());
      } else if (link.block >= 0) {
        angles = Eigen::Map<const Eigen::Vector3d>(x[link.block]);
      }
      const Eigen::Vector3d next = RestJoint(link.joint, x[betas_]);
      at[l + 1].place = at[l].place + at[l].rotation * (next - rest);
      at[l + 1].rotation = at[l].rotation * ExpSO3(angles);
      if (with_turns) at[l + 1].turn = at[l].rotation * LeftJacobianSO3(angles);
      rest = next;
    }
  }

  // Of the chain's last joint.
  Eigen::Matrix<double, 3, Eigen::Dynamic> ShapeJacobian(const Posed* at) const {
    Eigen::Matrix<double, 3, Eigen::Dynamic> J = body_.J_rest.topRows<3>();
    for (std::size_t l = 0; l < chain_.size(); ++l) {
      const int joint = chain_[l].joint;
      J.noalias() += at[l].rotation * (body_.J_rest.middleRows<3>(3 * joint) -
                                       body_.J_rest.middleRows<3>(3 * kJointParents[joint]));
    }
    return J;
  }

  // g and g'(s) / s.
  std::pair<double, double> Robust(double s) const {
    const double c2 = scale_ * scale_, u = s * s / c2;
    if (u < 1e-6) return {1.0 - 0.25 * u, -0.5 / c2};
    const double rho = std::log1p(u), g = std::sqrt(rho / u);
    // g^2 = log(1 + u) / u, u' = 2 s / c^2.
    return {g, (1.0 / (1.0 + u) - rho / u) / (u * g * c2)};
  }

  const MarkedBody& body_;
  SeenMarkers seen_;
  double scale_;
  std::vector<Link> chain_;  // from below the root to the joint
  const FreePose::Hand* hand_ = nullptr;
  int betas_ = 0;  // block
};

}  // namespace holdfast
