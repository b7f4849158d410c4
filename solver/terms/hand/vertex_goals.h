// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "solver/terms/hand/hand_term.h"
#include "solver/terms/hand/penetration.h"

namespace holdfast {

/// Target positions for hand vertices, from another hand or another object.
///
///   E = sum_i w_i |z_i - x_i|^2
///
/// Residuals z_i - x_i, meters, object frame, three per vertex; x_i is the vertex's target and w_i
/// (unitless) its weight. Never returns false. Weight: on the sum.
class VertexGoals final : public VertexTerm {
 public:
  /// `goals` (3 x N): object frame; `weights` (N): zero for vertices without a target.
  VertexGoals(Eigen::Matrix3Xd goals, Eigen::VectorXd weights, double weight)
      : goals_(std::move(goals)), weights_(std::move(weights)), weight_(weight) {}

  double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const override {
    double energy = 0.0;
    for (Eigen::Index i = 0; i < goals_.cols(); ++i) {
      if (weights_(i) == 0.0) continue;
      const Eigen::Vector3d difference = z.col(i) - goals_.col(i);
      const double squares = weights_(i) * difference.squaredNorm();
      VertexQuadratic& quadratic = quadratics[static_cast<std::size_t>(i)];
      quadratic.hessian.diagonal().array() += weight_ * weights_(i);
      quadratic.gradient += weight_ * weights_(i) * difference;
      quadratic.cost += 0.5 * weight_ * squares;
      energy += squares;
    }
    return energy;
  }

 private:
  Eigen::Matrix3Xd goals_;
  Eigen::VectorXd weights_;
  double weight_;
};

/// r = w (d - target): attracts points of a pad to the surface from either side.
struct GraspContactShape {
  double weight = 1.0;  ///< per meter
  double target = 0.0;  ///< meters; slightly negative presses the pad's soft tissue

  std::pair<double, double> operator()(double distance) const {
    return {weight * (distance - target), weight};
  }
};

/// Pads on the surface: E = sum_i w^2 (d_i - target)^2 over the points selected to touch.
using GraspContactTerm = SkinDistanceTerm<GraspContactShape>;

/// E_s: contacts slide along the surface, not off it. Replaces E_d and E_c for objects that are
/// turned or squeezed in the fingers. Over the hand vertices in contact at the start of the hold,
///
///   E_s = sum_i (d(z_i) - d_i0)^2 + share |(I - n_i n_i^T)(z_i - y_i)|^2,   m^2
///
/// d: the object's signed distance; d_i0: that of the vertex at the start of the hold; y_i:
/// position of the vertex on the object in the last solved frame; n_i: surface normal there. The
/// second part is a weak drag: it selects the shortest of all motions along the surface, and an
/// object that is free in the fingers moves with them. No friction model and no forces are
/// involved. Weight: lambda_s, on the sum; not part of the paper's energy.
class Slip final : public VertexTerm {
 public:
  /// `z` (3 x N, object frame, meters): the hand at the start of the hold. Contacts are the
  /// vertices at most `touch_m` farther than the nearest one. `object` must outlive the term.
  Slip(const DistanceGrid& object, const Eigen::Matrix3Xd& z, double touch_m, double weight,
       double drag_share)
      : object_(object), weight_(weight), drag_(drag_share) {
    Eigen::VectorXd distances(z.cols());
    for (Eigen::Index i = 0; i < z.cols(); ++i) distances(i) = object.Distance(z.col(i));
    const double limit = std::max(0.0, distances.minCoeff()) + touch_m;
    for (Eigen::Index i = 0; i < z.cols(); ++i) {
      if (distances(i) < limit) contacts_.push_back({i, distances(i)});
    }
    MoveTo(z);
  }

  /// Position y_i and normal n_i of a contact on the object.
  struct Mark {
    Eigen::Vector3d at, normal;
  };

  /// Marks of a hand at `z`, one per contact.
  std::vector<Mark> MarksOf(const Eigen::Matrix3Xd& z) const {
    std::vector<Mark> marks;
    for (const Contact& contact : contacts_) {
      Mark mark{z.col(contact.vertex), Eigen::Vector3d::Zero()};
      object_.Distance(mark.at, &mark.normal);
      mark.normal.normalize();
      marks.push_back(mark);
    }
    return marks;
  }
  /// Sets the drag targets from here on.
  void SetMarks(std::vector<Mark> marks) { marks_ = std::move(marks); }
  /// Call when the frame is solved: sets the drag targets to the current vertices.
  void MoveTo(const Eigen::Matrix3Xd& z) { SetMarks(MarksOf(z)); }

  double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const override {
    double energy = 0.0;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      const Contact& contact = contacts_[k];
      Eigen::Vector3d gradient;
      const double off = object_.Distance(z.col(contact.vertex), &gradient) - contact.distance;
      const Eigen::Vector3d& n = marks_[k].normal;
      const Eigen::Matrix3d along = Eigen::Matrix3d::Identity() - n * n.transpose();
      const Eigen::Vector3d travel = along * (z.col(contact.vertex) - marks_[k].at);
      const double squares = off * off + drag_ * travel.squaredNorm();
      VertexQuadratic& quadratic = quadratics[static_cast<std::size_t>(contact.vertex)];
      quadratic.hessian += weight_ * (gradient * gradient.transpose() + drag_ * along);
      quadratic.gradient += weight_ * (off * gradient + drag_ * travel);
      quadratic.cost += 0.5 * weight_ * squares;
      energy += squares;
    }
    return energy;
  }

  int NumContacts() const { return static_cast<int>(contacts_.size()); }  ///< vertices in contact

 private:
  struct Contact {
    Eigen::Index vertex;
    double distance;  // d_i0
  };

  const DistanceGrid& object_;
  double weight_, drag_;
  std::vector<Contact> contacts_;
  std::vector<Mark> marks_;  // one per contact
};

}  // namespace holdfast
