// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "geometry/render/camera.h"

namespace holdfast {

/// Which triangle is nearest at every sample of a view: a z-buffer that stores ids instead of
/// colours, so that only what is seen is ever shaded. Depth is kept as 1/z, linear on the screen.
class VisibilityBuffer {
 public:
  static constexpr std::uint32_t kNothing = 0;

  /// `view` at the resolution of the samples.
  explicit VisibilityBuffer(const View& view);

  /// Draws one triangle (corners in the camera frame) under `id`, not kNothing. Clips at the near
  /// plane and far outside the picture; triangles without area or with non-finite corners vanish.
  void Draw(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            std::uint32_t id);

  std::uint32_t Id(int x, int y) const { return id_[Index(x, y)]; }
  /// 1 / z in 1/metres; 0 where nothing was drawn.
  float InverseDepth(int x, int y) const { return inverse_depth_[Index(x, y)]; }

 private:
  std::size_t Index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(view_.Width()) +
           static_cast<std::size_t>(x);
  }
  void DrawClipped(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   std::uint32_t id);

  View view_;
  std::vector<float> inverse_depth_;
  std::vector<std::uint32_t> id_;
};

}  // namespace holdfast
