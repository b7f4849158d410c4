// SPDX-License-Identifier: MIT
#include "solver/handover/passage_easing.h"

#include <array>

#include <Eigen/Cholesky>

namespace holdfast {
namespace {

constexpr double kFollow = 1e-3, kFirmer = 1.6;
constexpr int kRounds = 100;

}  // namespace

Eigen::Matrix3Xd EasedWay(const Eigen::Matrix3Xd& way, const WayEnds& ends,
                          const std::function<bool(int, const Eigen::Vector3d&)>& is_clear) {
  const auto count = static_cast<int>(way.cols());
  const auto known = [&](int k) -> const std::optional<Eigen::Vector3d>& {
    if (k < 0) return k == -1 ? ends.before : ends.two_before;
    return k == count ? ends.after : ends.two_after;
  };
  // Of the second differences: the square's matrix, and what the known ends add.
  Eigen::MatrixXd bend = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixX3d pull = Eigen::MatrixX3d::Zero(count, 3);
  for (int k = -1; k <= count; ++k) {
    constexpr std::array kStencil = {1.0, -2.0, 1.0};
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(count);
    Eigen::RowVector3d rest = Eigen::RowVector3d::Zero();
    bool whole = true;
    for (int i = 0; i < 3; ++i) {
      const int at = k - 1 + i;
      if (at >= 0 && at < count) {
        row(at) = kStencil[i];
      } else if (const auto& end = known(at)) {
        rest += kStencil[i] * end->transpose();
      } else {
        whole = false;
      }
    }
    if (!whole) continue;
    bend += row.transpose() * row;
    pull -= row.transpose() * rest;
  }
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(count, kFollow);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd normal = bend;
    normal.diagonal() += weights;
    const Eigen::MatrixX3d right = pull + weights.asDiagonal() * way.transpose();
    const Eigen::Matrix3Xd eased = normal.ldlt().solve(right).transpose();
    bool clear = true;
    for (int k = 0; k < count; ++k) {
      if (is_clear(k, eased.col(k))) continue;
      clear = false;
      weights(k) *= kFirmer;
    }
    if (clear) return eased;
  }
  return way;
}

}  // namespace holdfast
