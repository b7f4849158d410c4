// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <ceres/cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/body/own_body.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/rotation.h"
#include "solver/clearance/arm_spline.h"

namespace holdfast {

/// Part of a carried object or a person's arms that collides with their own body.
enum class MeetingPart { kNone, kObject, kRightArm, kLeftArm };
std::string_view MeetingPartName(MeetingPart part);  ///< "object", "right arm"; empty for none

/// Detects collisions of object, hands and forearms with the body of the person who carries the
/// object, and with a table. Const, shared by threads; `body` must outlive it.
class BodyCollisionDetector {
 public:
  /// Samples points about `spacing_m` apart on the object (meters, its own frame) and on hands and
  /// forearms. `left_out`: the values that Measure will be called with.
  BodyCollisionDetector(const BodySurface& body, const TriangleMesh& object,
                        std::span<const std::uint8_t> left_out, double spacing_m = 0.01);

  /// Keeps body and arms, but samples other points.
  void LookAt(const TriangleMesh& object, double spacing_m);

  /// Adds the top of a table that stands still as an obstacle: the box around the upper 5 cm of
  /// `mesh` (in the frame of `world_from_table`, z up), 12 cm thick. Points leave it upwards or by
  /// the sides.
  void AddTable(const TriangleMesh& mesh, const Eigen::Isometry3d& world_from_table);

  /// Adds the object as an obstacle of hands and forearms that do not hold it. `distance` (object
  /// frame) must outlive this. `at_lips`: it needs no clearance from the body.
  void AddObject(const DistanceGrid& distance, bool at_lips) {
    distance_ = &distance;
    at_lips_ = at_lips;
  }

  /// A sample point near the skin or the table.
  struct Point {
    Eigen::Vector3d at;  ///< world, meters
    OwnBody::Touch touch;
    double wrist_share;  ///< weight of following the wrist; the rest follows the elbow
    /// Needs no clearance: the object at the table, a cup at the lips, a free hand at the object.
    bool may_touch = false;
  };
  struct Frame {
    double depth_m = 0.0;     ///< of the deepest point; 0: none inside
    double nearest_m = -1.0;  ///< maximum depth of a point, negative outside the skin
    std::array<double, 2> arm_depth_m = {};  ///< for the right and the left arm
    std::array<std::vector<Point>, 2> near;  ///< likewise
    std::array<bool, 2> near_table = {};     ///< a point is within 15 cm of the table
    /// For the right and the left arm while it does not hold, with AddObject; not part of depth_m.
    std::array<double, 2> in_object_m = {};
  };

  /// Measures one frame. `state` has all vertices; `arms` (bits as in Clip::holding_hand) hold the
  /// object (ignored if none). The obstacle excludes the arms in `left_out` (which include `arms`)
  /// for these and the object, and both arms for the others. Includes points up to `within_m`
  /// outside the skin, those of the object with the right arm where both hold.
  Frame Measure(const BodyState& state, const Eigen::Isometry3d& world_from_object,
                std::uint8_t arms, std::uint8_t left_out, double within_m) const;

 private:
  // Upper part of a table, as a box in the table's frame.
  struct TableTop {
    Eigen::Isometry3d world_from_table;
    Eigen::AlignedBox3d box;

    // Nothing for points below the box.
    std::optional<OwnBody::Touch> Query(const Eigen::Vector3d& point) const;
  };

  OwnBody::Touch InObject(const Eigen::Isometry3d& world_from_object,
                          const Eigen::Vector3d& point) const;

  using Clusters = std::vector<std::vector<int>>;  // columns near each other
  static Clusters Clustered(const Eigen::Matrix3Xd& points);

  const BodySurface& body_;
  Eigen::Matrix3Xd object_;                   // samples, object frame
  std::array<std::vector<int>, 2> skin_;      // vertices of hand and forearm
  std::array<std::vector<double>, 2> share_;  // of these, weight of following the wrist
  Clusters object_clusters_;
  std::array<Clusters, 2> skin_clusters_;
  std::array<std::optional<OwnBody>, 4> obstacles_;  // by the excluded arms
  std::optional<TableTop> table_;
  const DistanceGrid* distance_ = nullptr;
  bool at_lips_ = false;
};

/// Keeps points of the object, the hand and the forearm outside the person's own body: each beyond
/// the tangent plane of the nearest skin.
///
///   r_i = max(0, n_i . (s_i - p_i(x)) + margin) / sigma,   one residual per point
///
/// s_i: nearest skin point; n_i: unit, out of the body; both fixed (OwnBody). p_i: the point,
/// world, meters, which follows the wrist or, on the forearm, partly the elbow. x: the arm's change
/// (12). Linear in p: the planes are updated for the new arm pose.
struct DepthInBody {
  struct Plane {
    Eigen::Vector3d in_elbow, in_wrist;  ///< the point, meters
    double wrist_share;                  ///< 1: fixed to the wrist
    Eigen::Vector3d surface, normal;
  };
  std::vector<Plane> planes;
  double margin_m = 0.003;
  double sigma_m = 0.001;

  int Rows() const { return static_cast<int>(planes.size()); }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmState& state, Residuals&& residuals, Jacobian&& J_residuals_change) const {
    for (int i = 0; i < Rows(); ++i) {
      const Plane& plane = planes[i];
      const Eigen::Vector3d by_wrist = state.WorldFrom(kArmWrist) * plane.in_wrist;
      const Eigen::Vector3d by_elbow = state.WorldFrom(kArmElbow) * plane.in_elbow;
      const Eigen::Vector3d point =
          plane.wrist_share * by_wrist + (1.0 - plane.wrist_share) * by_elbow;
      const double within = plane.normal.dot(plane.surface - point) + margin_m;
      residuals(i) = std::max(0.0, within) / sigma_m;
      J_residuals_change.row(i).setZero();
      if (within <= 0.0) continue;
      const Eigen::RowVector3d slope = -plane.normal.transpose() / sigma_m;
      J_residuals_change.row(i) =
          plane.wrist_share * slope * state.PointJacobian(kArmWrist, by_wrist);
      if (plane.wrist_share < 1.0) {
        J_residuals_change.row(i) +=
            (1.0 - plane.wrist_share) * slope * state.PointJacobian(kArmElbow, by_elbow);
      }
    }
  }
};

/// Keeps the relative pose of two hands that hold one rigid object: the left wrist follows the
/// right.
///
///   (R, p) = W_right(x) C,   r = [(p_left(y) - p) / sigma_m;  log(R_left(y) R^T) / sigma_rad]
///
/// 6 residuals, world. C: the left wrist in the right wrist's frame, from the clip, meters; x, y:
/// the changes of the right and the left arm (12 each).
struct HandClosure {
  static constexpr int kRows = 6;
  Eigen::Isometry3d right_from_left = Eigen::Isometry3d::Identity();  ///< C
  double sigma_m = 2e-4;
  double sigma_rad = 1e-3;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmState& right, const ArmState& left, Residuals&& residuals,
                Jacobian&& J_residuals_right, Jacobian&& J_residuals_left) const {
    const Eigen::Isometry3d carried = right.WorldFrom(kArmWrist) * right_from_left;
    const Eigen::Isometry3d& now = left.WorldFrom(kArmWrist);
    const Eigen::Vector3d turn = LogSO3(now.linear() * carried.linear().transpose());
    residuals.template head<3>() = (now.translation() - carried.translation()) / sigma_m;
    residuals.template tail<3>() = turn / sigma_rad;
    // R_left R^T rotates by w_left - (R_left R^T) w_right on the left.
    const Eigen::Matrix3d inverse = InverseLeftJacobianSO3(turn) / sigma_rad;
    J_residuals_left.template topRows<3>() =
        left.PointJacobian(kArmWrist, now.translation()) / sigma_m;
    J_residuals_left.template bottomRows<3>() = inverse * left.TurnJacobian(kArmWrist);
    J_residuals_right.template topRows<3>() =
        -right.PointJacobian(kArmWrist, carried.translation()) / sigma_m;
    J_residuals_right.template bottomRows<3>() =
        -inverse * now.linear() * carried.linear().transpose() * right.TurnJacobian(kArmWrist);
  }
};

/// Keeps the hand, and with it the object, at its pose in the clip, with soft limits on
/// displacement and rotation.
///
///   w = log(R(x) R_0^T)
///   r = [(p(x) - p_0) / sigma_m;  w / sigma_rad;
///        max(0, |p(x) - p_0| - most_m) / sigma_most_m;  max(0, |w| - most_rad) / sigma_most_rad]
///
/// 8 residuals, world. (R, p): the wrist's pose, meters; (R_0, p_0): the clip's. x: the arm's
/// change (12). sigma_rad is per axis: rotation about z, the vertical, spills nothing.
struct HandStay {
  static constexpr int kRows = 8;
  Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();  ///< (R_0, p_0)
  double sigma_m = 0.03;
  Eigen::Vector3d sigma_rad = Eigen::Vector3d::Constant(8.0 * kDegree);
  double most_m = 0.1, sigma_most_m = 0.0005;
  double most_rad = 28.0 * kDegree, sigma_most_rad = 0.1 * kDegree;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmState& state, Residuals&& residuals, Jacobian&& J_residuals_change) const {
    const Eigen::Isometry3d& now = state.WorldFrom(kArmWrist);
    const Eigen::Vector3d turn = LogSO3(now.linear() * wrist.linear().transpose());
    const Eigen::Vector3d shift = now.translation() - wrist.translation();
    const double distance = shift.norm();
    const J_point_arm J_shift = state.PointJacobian(kArmWrist, now.translation());
    residuals.template head<3>() = shift / sigma_m;
    residuals.template segment<3>(3) = turn.cwiseQuotient(sigma_rad);
    const double angle = turn.norm();
    residuals(6) = std::max(0.0, distance - most_m) / sigma_most_m;
    residuals(7) = std::max(0.0, angle - most_rad) / sigma_most_rad;
    J_residuals_change.template topRows<3>() = J_shift / sigma_m;
    J_residuals_change.template middleRows<3>(3) = sigma_rad.cwiseInverse().asDiagonal() *
                                                   InverseLeftJacobianSO3(turn) *
                                                   state.TurnJacobian(kArmWrist);
    J_residuals_change.template bottomRows<2>().setZero();
    if (distance > most_m) {
      J_residuals_change.row(6) = shift.transpose() / (distance * sigma_most_m) * J_shift;
    }
    if (angle > most_rad) {  // the component of a rotation along its own axis
      J_residuals_change.row(7) =
          turn.transpose() / (angle * sigma_most_rad) * state.TurnJacobian(kArmWrist);
    }
  }
};

using ArmRows = Eigen::Matrix<double, Eigen::Dynamic, 12, Eigen::RowMajor>;

/// One arm in one frame: DepthInBody, HandStay and ArmRange as a function of the four control
/// points (12 each) around it. `basis`: their weights.
class ClearanceBlock final : public ceres::CostFunction {
 public:
  ClearanceBlock(const ArmFrame& frame, DepthInBody depth, const HandStay& stay,
                 const ArmRange& range, const Eigen::Vector4d& basis);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  ArmFrame frame_;
  DepthInBody depth_;
  HandStay stay_;
  ArmRange range_;
  Eigen::Vector4d basis_;
};

/// Both arms in one frame: HandClosure as a function of four control points of the right and then
/// four of the left arm (12 each).
class ClosureBlock final : public ceres::CostFunction {
 public:
  ClosureBlock(const ArmFrame& right, const ArmFrame& left, const HandClosure& closure,
               const Eigen::Vector4d& basis);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  ArmFrame right_, left_;
  HandClosure closure_;
  Eigen::Vector4d basis_;
};

}  // namespace holdfast
