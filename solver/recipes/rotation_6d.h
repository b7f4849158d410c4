// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace holdfast {

/// Six numbers for a rotation (Zhou et al. 2019), in IMoS's order: the first two rows of R.
using Rotation6d = Eigen::Matrix<double, 6, 1>;

inline Rotation6d To6d(const Eigen::Matrix3d& R) {
  Rotation6d x;
  x << R.row(0).transpose(), R.row(1).transpose();
  return x;
}

/// The rotation that six numbers stand for, by Gram-Schmidt. With `J_turn_x` (3 x 6) also its
/// derivative: R(x + dx) = exp([J_turn_x dx]x) R(x) to first order. The two rows must not be
/// parallel.
inline Eigen::Matrix3d From6d(const Rotation6d& x, Eigen::Matrix<double, 3, 6>* J_turn_x) {
  const Eigen::Vector3d a1 = x.head<3>(), a2 = x.tail<3>();
  const double length1 = a1.norm();
  const Eigen::Vector3d b1 = a1 / length1;
  const double along = b1.dot(a2);
  const Eigen::Vector3d rest = a2 - along * b1;
  const double length2 = rest.norm();
  const Eigen::Vector3d b2 = rest / length2, b3 = b1.cross(b2);
  Eigen::Matrix3d R;
  R << b1.transpose(), b2.transpose(), b3.transpose();
  if (J_turn_x != nullptr) {
    for (int k = 0; k < 6; ++k) {
      const Rotation6d unit = Rotation6d::Unit(k);
      const Eigen::Vector3d da1 = unit.head<3>(), da2 = unit.tail<3>();
      const Eigen::Vector3d db1 = (da1 - b1.dot(da1) * b1) / length1;
      const Eigen::Vector3d d_rest = da2 - (db1.dot(a2) + b1.dot(da2)) * b1 - along * db1;
      const Eigen::Vector3d db2 = (d_rest - b2.dot(d_rest) * b2) / length2;
      Eigen::Matrix3d dR;
      dR << db1.transpose(), db2.transpose(), (db1.cross(b2) + b1.cross(db2)).transpose();
      const Eigen::Matrix3d turn = dR * R.transpose();  // skew
      J_turn_x->col(k) = Eigen::Vector3d(turn(2, 1), turn(0, 2), turn(1, 0));
    }
  }
  return R;
}

}  // namespace holdfast
