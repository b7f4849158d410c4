// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"

namespace holdfast {

/// A hand state shared by the residual blocks of one problem: evaluated once per finger pose for
/// any number of terms. Not thread-safe: use one per problem, and solve with `num_threads = 1`.
class HandEvaluation {
 public:
  /// `hand` must outlive this. The body is fixed at `pose` and `trans` (SetBody changes it).
  HandEvaluation(const HandModel& hand, const JointPose& pose, const Eigen::Vector3d& trans);

  void SetBody(const JointPose& pose, const Eigen::Vector3d& trans);
  const HandModel& Hand() const { return state_.Hand(); }

  /// State for these 45 parameters; valid until the next call.
  const HandState& At(const double* fingers, bool with_jacobian);
  /// The same without Jacobian; by value, as the state does not refer to `fingers`.
  const HandState& At(FingerPose fingers) { return At(fingers.data(), false); }

  /// row += direction^T d vertex / d fingers (`row` has 45 entries), at the pose of the last call
  /// of At, which must have requested the Jacobian.
  void AddRow(int vertex, const Eigen::Vector3d& direction, double* row) const {
    state_.AddJacobianRow(vertex, direction, row);
  }

 private:
  HandState state_;
  FingerPose fingers_;
  bool valid_ = false;
  bool has_jacobian_ = false;
};

/// Points in patches of neighbors, to find the minimum distance to an object without testing all of
/// them: a patch is skipped if its center is too far away. Const and shared by threads.
class PointPatches {
 public:
  PointPatches() = default;
  /// Uses the `points` (3 x n, meters) with these ids. `give`: fraction by which patches may grow
  /// when the points move later.
  PointPatches(const Eigen::Matrix3Xd& points, std::vector<int> ids, double give = 0.0);
  /// Uses all `points`.
  explicit PointPatches(const Eigen::Matrix3Xd& points);

  const std::vector<int>& Ids() const { return ids_; }

  /// Minimum of `most` and `value(id)` over the points. `value` must be 1-Lipschitz, like
  /// distances. Returns early once below `enough`.
  template <typename Value>
  double Least(const Value& value, double most = std::numeric_limits<double>::infinity(),
               double enough = -std::numeric_limits<double>::infinity()) const {
    std::array<double, kMaxPatches> middle;
    double least = most;
    for (std::size_t p = 0; p < patches_.size(); ++p) {
      middle[p] = value(ids_[patches_[p].begin]);
      least = std::min(least, middle[p]);
      if (least < enough) return least;
    }
    for (std::size_t p = 0; p < patches_.size(); ++p) {
      if (middle[p] - patches_[p].radius >= least) continue;
      for (int n = patches_[p].begin + 1; n < patches_[p].end; ++n) {
        if (middle[p] - reach_[n] < least) least = std::min(least, value(ids_[n]));
      }
      if (least < enough) return least;
    }
    return least;
  }

  /// Calls visit(id) for the points at which `value`, also 1-Lipschitz, may be below `limit`.
  template <typename Value, typename Visit>
  void ForBelow(double limit, const Value& value, const Visit& visit) const {
    for (const Patch& patch : patches_) {
      const double middle = value(ids_[patch.begin]);
      if (middle - patch.radius >= limit) continue;
      for (int n = patch.begin; n < patch.end; ++n) {
        if (middle - reach_[n] < limit) visit(ids_[n]);
      }
    }
  }

 private:
  static constexpr int kMaxPatches = 256;
  struct Patch {
    int begin, end;  // in ids_; the first is the center
    double radius;
  };
  void Split(const Eigen::Matrix3Xd& points, int begin, int end, int size, double give);

  std::vector<int> ids_;
  std::vector<double> reach_;  // per id, distance from its patch center
  std::vector<Patch> patches_;
};

}  // namespace holdfast
