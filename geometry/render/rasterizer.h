// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"
#include "geometry/render/camera.h"
#include "geometry/render/image.h"

namespace holdfast {

/// One mesh of a picture, in the world. Colors are sRGB in [0, 1].
struct RenderItem {
  const TriangleMesh* mesh = nullptr;
  Eigen::Vector3d color{0.72, 0.70, 0.68};
  /// (3 x V) colors per vertex in place of `color`, or null.
  const Eigen::Matrix3Xd* vertex_colors = nullptr;
  /// Half transparent: drawn in every other sample, without a shadow.
  bool translucent = false;
};

struct RenderOptions {
  int width = 640;  ///< pixels
  int height = 480;
  int supersampling = 2;  ///< samples per pixel and side, 1..4
  bool ground = true;     ///< a plane with grid and shadow, visible only from above
  double ground_height_m = 0.0;
  double grid_spacing_m = 0.5;  ///< 0: no grid
  Eigen::Vector3d background{0.93, 0.94, 0.95};
};

/// Renders the meshes with smooth shading, lit from the viewer's left. Single-threaded and
/// deterministic: the same scene gives the same bytes. Skips triangles that are degenerate, behind
/// the camera or not finite. Throws Error for vertex ids out of range, colors that do not match the
/// vertices, and options out of range.
Image Render(std::span<const RenderItem> items, const Camera& camera, const RenderOptions& options);

}  // namespace holdfast
