// SPDX-License-Identifier: MIT
#include "solver/robot/near_samples.h"

#include <numeric>

namespace holdfast {
namespace {

// Recursively bisects the longest extent at whole blocks until one block is left.
void Sort(const Eigen::Matrix3Xd& points, std::vector<int>& order, int begin, int end) {
  const int blocks = (end - begin + kSampleBlock - 1) / kSampleBlock;
  if (blocks < 2) return;
  Eigen::AlignedBox3d box;
  for (int i = begin; i < end; ++i) box.extend(points.col(order[i]));
  Eigen::Index axis;
  box.sizes().maxCoeff(&axis);
  const int middle = begin + blocks / 2 * kSampleBlock;
  std::nth_element(
      order.begin() + begin, order.begin() + middle, order.begin() + end,
      [&](int a, int b) { return std::pair(points(axis, a), a) < std::pair(points(axis, b), b); });
  Sort(points, order, begin, middle);
  Sort(points, order, middle, end);
}

}  // namespace

Eigen::Matrix3Xd InBlocks(const Eigen::Matrix3Xd& points) {
  std::vector<int> order(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  Sort(points, order, 0, static_cast<int>(points.cols()));
  return points(Eigen::all, order);
}

Eigen::Matrix4Xd NearSamples::BallsAround(const Eigen::Matrix3Xd& points) {
  const Eigen::Index blocks = (points.cols() + kSampleBlock - 1) / kSampleBlock;
  Eigen::Matrix4Xd balls(4, blocks);
  for (Eigen::Index b = 0; b < blocks; ++b) {
    const Eigen::Index begin = b * kSampleBlock;
    const auto block =
        points.middleCols(begin, std::min<Eigen::Index>(kSampleBlock, points.cols() - begin));
    const Eigen::Vector3d center = 0.5 * (block.rowwise().minCoeff() + block.rowwise().maxCoeff());
    balls.col(b) << center, (block.colwise() - center).colwise().norm().maxCoeff();
  }
  return balls;
}

}  // namespace holdfast
