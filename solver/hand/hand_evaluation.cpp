// SPDX-License-Identifier: MIT
#include "solver/hand/hand_evaluation.h"

#include <numeric>
#include <utility>

#include <Eigen/Geometry>

namespace holdfast {

HandEvaluation::HandEvaluation(const HandModel& hand, const JointPose& pose,
                               const Eigen::Vector3d& trans)
    : state_(hand) {
  SetBody(pose, trans);
}

void HandEvaluation::SetBody(const JointPose& pose, const Eigen::Vector3d& trans) {
  state_.SetBody(pose, trans);
  valid_ = false;
}

const HandState& HandEvaluation::At(const double* fingers, bool with_jacobian) {
  const Eigen::Map<const FingerPose> wanted(fingers);
  if (valid_ && fingers_ == wanted) {
    if (with_jacobian && !has_jacobian_) state_.EvaluateJacobians();
    has_jacobian_ |= with_jacobian;
    return state_;
  }
  fingers_ = wanted;
  state_.Evaluate(fingers_, with_jacobian);
  valid_ = true;
  has_jacobian_ = with_jacobian;
  return state_;
}

PointPatches::PointPatches(const Eigen::Matrix3Xd& points, std::vector<int> ids, double give)
    : ids_(std::move(ids)) {
  constexpr int kSize = 12;
  const int count = static_cast<int>(ids_.size());
  // Repeated halving: no patch is smaller than half of `size`.
  Split(points, 0, count, std::max(kSize, 2 * count / kMaxPatches + 2), give);
}

PointPatches::PointPatches(const Eigen::Matrix3Xd& points) {
  std::vector<int> ids(static_cast<std::size_t>(points.cols()));
  std::iota(ids.begin(), ids.end(), 0);
  *this = PointPatches(points, std::move(ids));
}

void PointPatches::Split(const Eigen::Matrix3Xd& points, int begin, int end, int size,
                         double give) {
  if (begin == end) return;
  Eigen::AlignedBox3d box;
  for (int n = begin; n < end; ++n) box.extend(points.col(ids_[n]));
  if (end - begin > size) {
    Eigen::Index axis;
    box.sizes().maxCoeff(&axis);
    const int middle = (begin + end) / 2;
    std::nth_element(ids_.begin() + begin, ids_.begin() + middle, ids_.begin() + end,
                     [&](int a, int b) {
                       return std::pair(points(axis, a), a) < std::pair(points(axis, b), b);
                     });
    Split(points, begin, middle, size, give);
    Split(points, middle, end, size, give);
    return;
  }
  const Eigen::Vector3d center = box.center();
  const auto from_center = [&](int i) { return (points.col(i) - center).squaredNorm(); };
  std::iter_swap(ids_.begin() + begin,
                 std::min_element(ids_.begin() + begin, ids_.begin() + end,
                                  [&](int a, int b) { return from_center(a) < from_center(b); }));
  double radius = 0.0;
  for (int n = begin; n < end; ++n) {
    reach_.push_back((1.0 + give) * (points.col(ids_[n]) - points.col(ids_[begin])).norm());
    radius = std::max(radius, reach_.back());
  }
  patches_.push_back({begin, end, radius});
}

}  // namespace holdfast
