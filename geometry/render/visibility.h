// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "geometry/render/camera.h"

namespace holdfast {

/// Z-buffer that stores the id of the nearest triangle per sample instead of a color, so that only
/// visible surfaces are shaded. Depth is stored as 1/z, which is linear on the screen.
class VisibilityBuffer {
 public:
  static constexpr std::uint32_t kNothing = 0;

  /// `view` at the resolution of the samples.
  explicit VisibilityBuffer(const View& view);

  /// Draws one triangle (corners in the camera frame) under `id`, not kNothing. Clips at the near
  /// plane and far outside the picture; skips triangles without area or with non-finite corners.
  /// `translucent`: only in every other sample, as on a chessboard.
  void Draw(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            std::uint32_t id, bool translucent = false);

  std::uint32_t Id(int x, int y) const { return id_[Index(x, y)]; }
  /// 1 / z in 1/meters; 0 if nothing was drawn.
  float InverseDepth(int x, int y) const { return inverse_depth_[Index(x, y)]; }

 private:
  std::size_t Index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(view_.Width()) +
           static_cast<std::size_t>(x);
  }
  void DrawClipped(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   std::uint32_t id, bool translucent);

  View view_;
  std::vector<float> inverse_depth_;
  std::vector<std::uint32_t> id_;
};

/// Coordinate limit of ScanTriangle, in samples, so that its fixed-point products fit 64 bits.
inline constexpr double kScanLimit = 1 << 20;

/// Calls visit(x, y) for every sample (x + 1/2, y + 1/2) of a width x height grid inside the
/// triangle, in either orientation. Corners are snapped to 1/256 sample, and edges follow the
/// top-left rule: triangles with a common edge leave no gap and visit no sample twice.
template <typename Visit>
void ScanTriangle(std::array<Eigen::Vector2d, 3> corner, int width, int height, Visit&& visit) {
  constexpr std::int64_t kOne = 256;
  std::array<std::int64_t, 3> x, y;
  for (int k = 0; k < 3; ++k) {
    x[k] = std::llround(corner[k].x() * kOne);
    y[k] = std::llround(corner[k].y() * kOne);
  }
  const std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
  if (area == 0) return;
  if (area < 0) {
    std::swap(x[1], x[2]);
    std::swap(y[1], y[2]);
  }
  // First and last sample center inside the bounding box.
  const auto first = [](std::int64_t v) { return (v + kOne / 2 - 1) >> 8; };
  const auto last = [](std::int64_t v) { return (v - kOne / 2) >> 8; };
  const auto [min_x, max_x] = std::minmax({x[0], x[1], x[2]});
  const auto [min_y, max_y] = std::minmax({y[0], y[1], y[2]});
  const int x0 = static_cast<int>(std::max<std::int64_t>(first(min_x), 0));
  const int x1 = static_cast<int>(std::min<std::int64_t>(last(max_x), width - 1));
  const int y0 = static_cast<int>(std::max<std::int64_t>(first(min_y), 0));
  const int y1 = static_cast<int>(std::min<std::int64_t>(last(max_y), height - 1));
  if (x0 > x1 || y0 > y1) return;

  std::array<std::int64_t, 3> row, step_x, step_y;
  for (int k = 0; k < 3; ++k) {
    const int n = (k + 1) % 3;
    const std::int64_t dx = x[n] - x[k];
    const std::int64_t dy = y[n] - y[k];
    const bool top_left = dy < 0 || (dy == 0 && dx > 0);
    row[k] = dx * (y0 * kOne + kOne / 2 - y[k]) - dy * (x0 * kOne + kOne / 2 - x[k]) -
             (top_left ? 0 : 1);
    step_x[k] = -dy * kOne;
    step_y[k] = dx * kOne;
  }
  for (int py = y0; py <= y1; ++py) {
    std::array<std::int64_t, 3> edge = row;
    for (int px = x0; px <= x1; ++px) {
      if ((edge[0] | edge[1] | edge[2]) >= 0) visit(px, py);
      for (int k = 0; k < 3; ++k) edge[k] += step_x[k];
    }
    for (int k = 0; k < 3; ++k) row[k] += step_y[k];
  }
}

}  // namespace holdfast
