// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/triangle_tree.h"
#include "geometry/rotation.h"
#include "solver/unknowns/free_pose.h"

namespace holdfast {

/// Body shape and degrees of freedom shared by the terms of all frames.
struct MarkedBody {
  FreePose free;
  Eigen::Matrix3Xd rest_joints;  ///< (3 x 55) at betas zero, meters
  Eigen::MatrixXd J_rest;        ///< d rest joints / d betas (165 x B)
  std::vector<int> joint;        ///< that each of the M markers follows
  /// Per marker, joints that the skin below it follows, with weights that sum to 1 (linear blend
  /// skinning). A marker with an empty list (or all, if `shares` is empty) follows its joint alone.
  std::vector<std::vector<std::pair<int, double>>> shares;

  std::vector<std::pair<int, double>> SharesOf(int marker) const {
    if (shares.empty() || shares[static_cast<std::size_t>(marker)].empty()) {
      return {{joint[static_cast<std::size_t>(marker)], 1.0}};
    }
    return shares[static_cast<std::size_t>(marker)];
  }
  /// World position of a marker; `rest` as RestJoints, `place` in its joint's frame in the T-pose.
  Eigen::Vector3d Carry(const BodyState& state, const Eigen::Matrix3Xd& rest, int marker,
                        const Eigen::Vector3d& place) const {
    Eigen::Vector3d world = Eigen::Vector3d::Zero();
    const Eigen::Vector3d x = rest.col(joint[static_cast<std::size_t>(marker)]) + place;
    for (const auto& [j, share] : SharesOf(marker)) {
      world += share * (state.WorldFromJoint(j) * Eigen::Vector3d(x - rest.col(j)));
    }
    return world;
  }
  int NumShape() const { return static_cast<int>(J_rest.cols()); }
  int NumMarkers() const { return static_cast<int>(joint.size()); }
  Eigen::Matrix3Xd RestJoints(const double* betas) const {
    Eigen::Matrix3Xd joints = rest_joints;
    Eigen::Map<Eigen::VectorXd>(joints.data(), joints.size()) +=
        J_rest * Eigen::Map<const Eigen::VectorXd>(betas, J_rest.cols());
    return joints;
  }
};

/// Markers observed in a frame.
struct SeenMarkers {
  std::vector<int> marker;      ///< index among the M markers
  Eigen::Matrix3Xd place;       ///< world, meters
  std::vector<double> sigma_m;  ///< standard deviation of each

  int Count() const { return static_cast<int>(marker.size()); }
  void Add(int m, const Eigen::Vector3d& at, double sigma) {
    marker.push_back(m);
    place.conservativeResize(3, Count());
    place.col(Count() - 1) = at;
    sigma_m.push_back(sigma);
  }
};

/// Groups the markers of a frame by the joint that they follow.
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

/// Distance between observed markers of one joint and their positions on the body (Loper et al.
/// 2014, eq. 4), robust to outliers:
///
///   r_k = g(|d_k|) d_k / sigma_k,  d_k = sum_j w_kj (p_j + R_j (x_k + J - J_j)) - m_k
///   g(s) = c sqrt(log(1 + s^2/c^2)) / s
///
/// 3 residuals per observed marker, meters over meters; |r|^2 is Cauchy's loss with scale c. p, R:
/// joints that the skin below the marker follows, with weights w (MarkedBody); J_j: their rest
/// positions; J: that of the markers' joint; x_k: offset of a marker from it in the T-pose.
/// Parameter blocks, as returned by Blocks(): root (6), the free parameters on the path from those
/// joints to the root (3 per joint, then those of a hand), betas (B), offset of each marker (3).
class MarkerDistance final : public ceres::CostFunction {
 public:
  /// One or more markers of the same joint. `body` must outlive it.
  MarkerDistance(const MarkedBody& body, SeenMarkers seen, double scale_m)
      : body_(body), joint_(body.joint[seen.marker[0]]), seen_(std::move(seen)), scale_(scale_m) {
    set_num_residuals(3 * seen_.Count());
    std::vector<int>& sizes = *mutable_parameter_block_sizes();
    sizes.push_back(FreePose::kRootSize);
    std::array<bool, kNumJoints> used{};
    for (const int marker : seen_.marker) {
      for (const auto& [joint, share] : body.SharesOf(marker)) {
        for (int a = joint; a > 0; a = kJointParents[a]) used[a] = true;
      }
    }
    std::array<int, kNumJoints> at{};  // links by joint; parents precede children
    for (int j = 1; j < kNumJoints; ++j) {
      if (!used[j]) continue;
      links_.push_back({j, at[kJointParents[j]]});
      at[j] = static_cast<int>(links_.size());
    }
    for (const int marker : seen_.marker) {
      shares_.emplace_back();
      for (const auto& [joint, share] : body.SharesOf(marker)) {
        shares_.back().emplace_back(at[joint], share);
      }
    }
    for (Link& link : links_) {
      link.column = body.free.Column(link.joint);
      if (link.column < 0) continue;
      link.block = static_cast<int>(sizes.size());
      sizes.push_back(3);
    }
    for (const FreePose::Hand& hand : body.free.Hands()) {
      for (Link& link : links_) {
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

  /// Parameter blocks within root (6), q (n), betas (B) and places (3 M).
  std::vector<double*> Blocks(double* root, double* q, double* betas, double* places) const {
    std::vector<double*> blocks = {root};
    for (const Link& link : links_) {
      if (link.column >= 0) blocks.push_back(q + link.column);
    }
    if (hand_ != nullptr) blocks.push_back(q + hand_->column);
    blocks.push_back(betas);
    for (const int marker : seen_.marker) blocks.push_back(places + 3 * marker);
    return blocks;
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    std::array<Posed, kNumJoints> at;
    Pose(x, J != nullptr, at);
    for (std::size_t b = 0; J != nullptr && b < parameter_block_sizes().size(); ++b) {
      if (J[b] != nullptr) Rows(J, static_cast<int>(b), 0, seen_.Count()).setZero();
    }
    std::vector<Matrix3B> by_shape;
    if (J != nullptr && J[betas_] != nullptr) by_shape = ShapeJacobians(at);
    const Eigen::Vector3d rest = RestJoint(joint_, x[betas_]);
    // Per link, the weights of its descendants and the weighted positions.
    std::array<double, kNumJoints> share_below;
    std::array<Eigen::Vector3d, kNumJoints> place_below;
    for (int k = 0; k < seen_.Count(); ++k) {
      const Eigen::Vector3d in_rest = rest + Eigen::Map<const Eigen::Vector3d>(x[betas_ + 1 + k]);
      share_below.fill(0.0);
      place_below.fill(Eigen::Vector3d::Zero());
      Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
      for (const auto& [l, share] : shares_[static_cast<std::size_t>(k)]) {
        share_below[l] += share;
        place_below[l] += share * (at[l].place + at[l].rotation * (in_rest - at[l].rest));
        R += share * at[l].rotation;
      }
      for (std::size_t l = links_.size(); l > 0; --l) {
        const int parent = links_[l - 1].parent;
        share_below[parent] += share_below[l];
        place_below[parent] += place_below[l];
      }
      const Eigen::Vector3d d = place_below[0] - seen_.place.col(k);
      const auto [g, slope] = Robust(d.norm());
      Eigen::Map<Eigen::Vector3d>(residuals + 3 * k) = g * d / seen_.sigma_m[k];
      if (J == nullptr) continue;
      // d (g d) = (g I + g'/s d d^T) dd.
      const Eigen::Matrix3d weight =
          (g * Eigen::Matrix3d::Identity() + slope * d * d.transpose()) / seen_.sigma_m[k];
      const auto turn = [&](std::size_t l) -> Eigen::Matrix3d {
        return -weight * Skew<double>(place_below[l] - share_below[l] * at[l].place) * at[l].turn;
      };
      if (J[0] != nullptr) Rows(J, 0, k, 1) << weight, turn(0);
      for (std::size_t l = 0; l < links_.size(); ++l) {
        const Link& link = links_[l];
        if (link.block < 0 || J[link.block] == nullptr || share_below[l + 1] == 0.0) continue;
        if (link.finger < 0) {
          Rows(J, link.block, k, 1) = turn(l + 1);
        } else {
          Rows(J, link.block, k, 1) +=
              turn(l + 1) * hand_->synergies.middleRows<3>(3 * link.finger);
        }
      }
      if (J[betas_] != nullptr) {
        for (const auto& [l, share] : shares_[static_cast<std::size_t>(k)]) {
          Rows(J, betas_, k, 1) += share * weight * by_shape[static_cast<std::size_t>(l)];
        }
      }
      if (J[betas_ + 1 + k] != nullptr) Rows(J, betas_ + 1 + k, k, 1) = weight * R;
    }
    return true;
  }

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Matrix3B = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  struct Link {
    int joint;
    int parent;       // preceding link, from 1; 0 is the root
    int column = -1;  // first of its three parameters in q
    int finger = -1;  // index of a finger joint in its hand
    int block = -1;   // parameter block; none: fixed at rest
  };
  // Root and links; `turn`: derivative of the world rotation vector by the axis-angle.
  struct Posed {
    Eigen::Matrix3d rotation, turn;
    Eigen::Vector3d place, rest;
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

  void Pose(double const* const* x, bool with_turns, std::array<Posed, kNumJoints>& at) const {
    const Eigen::Map<const Eigen::Vector3d> shift(x[0]), root(x[0] + 3);
    at[0].rest = RestJoint(0, x[betas_]);
    at[0].place = at[0].rest + shift;
    at[0].rotation = ExpSO3(root);
    if (with_turns) at[0].turn = LeftJacobianSO3(root);
    for (std::size_t l = 0; l < links_.size(); ++l) {
      const Link& link = links_[l];
      const Posed& before = at[link.parent];
      Posed& here = at[l + 1];
      Eigen::Vector3d angles = body_.free.Rest().col(link.joint);
      if (link.finger >= 0) {
        angles += hand_->synergies.middleRows<3>(3 * link.finger) *
                  Eigen::Map<const Eigen::VectorXd>(x[link.block], hand_->synergies.cols());
      } else if (link.block >= 0) {
        angles = Eigen::Map<const Eigen::Vector3d>(x[link.block]);
      }
      here.rest = RestJoint(link.joint, x[betas_]);
      here.place = before.place + before.rotation * (here.rest - before.rest);
      here.rotation = before.rotation * ExpSO3(angles);
      if (with_turns) here.turn = before.rotation * LeftJacobianSO3(angles);
    }
  }

  // Jacobians of a point fixed in each link's frame, at the rest position of the markers' joint.
  std::vector<Matrix3B> ShapeJacobians(const std::array<Posed, kNumJoints>& at) const {
    const auto of_rest = [&](int joint) { return body_.J_rest.middleRows<3>(3 * joint); };
    std::vector<Matrix3B> J = {of_rest(0)};
    for (std::size_t l = 0; l < links_.size(); ++l) {
      const Link& link = links_[l];
      J.push_back(J[static_cast<std::size_t>(link.parent)] +
                  at[link.parent].rotation *
                      (of_rest(link.joint) - of_rest(kJointParents[link.joint])));
    }
    for (std::size_t l = 0; l < J.size(); ++l) {
      const int joint = l == 0 ? 0 : links_[l - 1].joint;
      J[l] += at[l].rotation * (of_rest(joint_) - of_rest(joint));
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
  int joint_;
  SeenMarkers seen_;
  double scale_;
  std::vector<Link> links_;                                  // parents first
  std::vector<std::vector<std::pair<int, double>>> shares_;  // links and weights per marker
  const FreePose::Hand* hand_ = nullptr;
  int betas_ = 0;  // block index
};

/// Skin around a marker in the T-pose, in the frame of the joint that the marker follows.
struct SkinPatch {
  std::vector<int> ids;       ///< n body vertices
  Eigen::Matrix3Xd vertices;  ///< (3 x n) at betas zero, meters
  Eigen::MatrixXd J_betas;    ///< (3 n x B)
  Eigen::Matrix3Xi faces;
};

/// Height of a marker on the skin equals that of the other markers of its size.
///
///   r = (s(x, betas) - h) / sigma    1 residual, meters over meters
///
/// s: signed distance of place x from the patch in the T-pose, positive outside. Parameter blocks:
/// betas (B), height h (1), place x (3).
class MarkerOnSkin final : public ceres::CostFunction {
 public:
  /// `patch` must outlive it.
  MarkerOnSkin(const SkinPatch& patch, double sigma_m) : patch_(patch), sigma_(sigma_m) {
    set_num_residuals(1);
    *mutable_parameter_block_sizes() = {static_cast<int>(patch.J_betas.cols()), 1, 3};
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    const Eigen::Map<const Eigen::VectorXd> betas(x[0], patch_.J_betas.cols());
    const Eigen::Map<const Eigen::Vector3d> place(x[2]);
    Eigen::Matrix3Xd vertices = patch_.vertices;
    vertices.reshaped() += patch_.J_betas * betas;
    double nearest2 = std::numeric_limits<double>::infinity();
    Eigen::Index face = 0;
    Eigen::Vector3d point;
    for (Eigen::Index f = 0; f < patch_.faces.cols(); ++f) {
      const Eigen::Vector3i c = patch_.faces.col(f);
      const Eigen::Vector3d on =
          ClosestOnTriangle(place, vertices.col(c(0)), vertices.col(c(1)), vertices.col(c(2)))
              .point;
      const double distance2 = (place - on).squaredNorm();
      if (distance2 >= nearest2) continue;
      nearest2 = distance2;
      face = f;
      point = on;
    }
    const Eigen::Vector3i c = patch_.faces.col(face);
    const Eigen::Vector3d a = vertices.col(c(0)), ab = vertices.col(c(1)) - a,
                          ac = vertices.col(c(2)) - a;
    const Eigen::Vector3d normal = ab.cross(ac).normalized();
    const double sign = (place - point).dot(normal) < 0.0 ? -1.0 : 1.0;
    const double distance = std::sqrt(nearest2);
    // On the surface, the normal is the limit of the direction to the marker.
    const Eigen::Vector3d out =
        distance > 1e-9 ? Eigen::Vector3d(sign / distance * (place - point)) : normal;
    residuals[0] = (sign * distance - x[1][0]) / sigma_;
    if (J != nullptr && J[0] != nullptr) {
      // The nearest point moves with its triangle; to first order, its motion within the triangle
      // does not matter.
      Eigen::Matrix<double, 3, 2> edges;
      edges << ab, ac;
      const Eigen::Vector2d uv = edges.colPivHouseholderQr().solve(point - a);
      const Eigen::Vector3d share(1.0 - uv.sum(), uv.x(), uv.y());
      Eigen::Map<Eigen::RowVectorXd> J_betas(J[0], betas.size());
      J_betas.setZero();
      for (int k = 0; k < 3; ++k) {
        J_betas -= share(k) / sigma_ * out.transpose() * patch_.J_betas.middleRows<3>(3 * c(k));
      }
    }
    if (J != nullptr && J[1] != nullptr) J[1][0] = -1.0 / sigma_;
    if (J != nullptr && J[2] != nullptr) Eigen::Map<Eigen::Vector3d>{J[2]} = out / sigma_;
    return true;
  }

 private:
  const SkinPatch& patch_;
  double sigma_;
};

/// Prior on a marker's place, from its label.
///
///   r = (x - a - A betas) / sigma    3 residuals, meters over meters
///
/// x: place in the frame of the joint that the marker follows. Blocks: betas (B), place x (3).
class MarkerPlacePrior final : public ceres::CostFunction {
 public:
  /// `J_usual` is (3 x B).
  MarkerPlacePrior(const Eigen::Vector3d& usual, Eigen::Matrix3Xd J_usual, double sigma_m)
      : usual_(usual), J_usual_(std::move(J_usual)), sigma_m_(sigma_m) {
    set_num_residuals(3);
    *mutable_parameter_block_sizes() = {static_cast<int>(J_usual_.cols()), 3};
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    using RowMajor = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const Eigen::VectorXd> betas(x[0], J_usual_.cols());
    const Eigen::Map<const Eigen::Vector3d> place(x[1]);
    Eigen::Map<Eigen::Vector3d>{residuals} = (place - usual_ - J_usual_ * betas) / sigma_m_;
    if (J != nullptr && J[0] != nullptr) {
      Eigen::Map<RowMajor>(J[0], 3, J_usual_.cols()) = -J_usual_ / sigma_m_;
    }
    if (J != nullptr && J[1] != nullptr) {
      Eigen::Map<RowMajor>(J[1], 3, 3) = Eigen::Matrix3d::Identity() / sigma_m_;
    }
    return true;
  }

 private:
  Eigen::Vector3d usual_;
  Eigen::Matrix3Xd J_usual_;
  double sigma_m_;
};

}  // namespace holdfast
