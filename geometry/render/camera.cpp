// SPDX-License-Identifier: MIT
#include "geometry/render/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

// Rows: right, down, forward.
Eigen::Matrix3d CameraFromWorldRotation(const Camera& camera) {
  const Eigen::Vector3d forward = (camera.target - camera.eye).normalized();
  Eigen::Vector3d right = forward.cross(camera.up);
  if (right.norm() < 1e-9 * camera.up.norm()) right = forward.unitOrthogonal();
  right.normalize();
  Eigen::Matrix3d rotation;
  rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  return rotation;
}

}  // namespace

Camera OrbitCamera(const Eigen::Vector3d& target, double azimuth_rad, double elevation_rad,
                   double distance_m) {
  Camera camera;
  camera.target = target;
  const Eigen::Vector3d direction(std::sin(azimuth_rad) * std::cos(elevation_rad),
                                  -std::cos(azimuth_rad) * std::cos(elevation_rad),
                                  std::sin(elevation_rad));
  camera.eye = target + distance_m * direction;
  // From straight above or below, "up" in the picture is away from the viewer.
  if (std::abs(std::cos(elevation_rad)) < 1e-6) {
    camera.up = Eigen::Vector3d(-std::sin(azimuth_rad), std::cos(azimuth_rad), 0.0);
    if (elevation_rad < 0.0) camera.up = -camera.up;
  }
  camera.near_m = std::clamp(0.01 * distance_m, 1e-5, 0.02);
  return camera;
}

Camera FitCamera(const Eigen::AlignedBox3d& box, double azimuth_rad, double elevation_rad,
                 double aspect, double margin) {
  const Eigen::Vector3d center =
      box.isEmpty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(box.center());
  Camera camera = OrbitCamera(center, azimuth_rad, elevation_rad, 1.0);
  const Eigen::Matrix3d camera_from_world = CameraFromWorldRotation(camera);
  const double tan_y = std::tan(0.5 * camera.vertical_fov_rad) / (1.0 + margin);
  const double tan_x = tan_y * aspect;
  double distance = 1e-3;
  if (!box.isEmpty()) {
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d corner =
          camera_from_world *
          (box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k)) - center);
      distance = std::max({distance, std::abs(corner.x()) / tan_x - corner.z(),
                           std::abs(corner.y()) / tan_y - corner.z()});
    }
  }
  return OrbitCamera(center, azimuth_rad, elevation_rad, distance);
}

Camera CloseUpCamera(const Eigen::Vector3d& point, double radius_m, double azimuth_rad,
                     double elevation_rad) {
  const Camera defaults;
  return OrbitCamera(point, azimuth_rad, elevation_rad,
                     radius_m / std::sin(0.5 * defaults.vertical_fov_rad));
}

View::View(const Camera& camera, int width, int height)
    : eye_(camera.eye), near_(camera.near_m), width_(width), height_(height) {
  if (width <= 0 || height <= 0) {
    throw Error("camera", fmt::format("a picture of {} x {} pixels", width, height),
                "Give a positive size.");
  }
  if (!((camera.target - camera.eye).norm() > 0.0) || !(camera.near_m > 0.0) ||
      !(camera.vertical_fov_rad > 0.0 && camera.vertical_fov_rad < std::numbers::pi)) {
    throw Error(
        "camera", "is invalid",
        "Eye and target must differ, near be positive, and the field of view lie in (0, pi).");
  }
  camera_from_world_ = CameraFromWorldRotation(camera);
  focal_ = 0.5 * height / std::tan(0.5 * camera.vertical_fov_rad);
  center_ = {0.5 * width, 0.5 * height};
}

}  // namespace holdfast
