// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace holdfast {

/// A pinhole camera in the world (z up, meters). The defaults face a standing person; people in
/// clips face -y.
struct Camera {
  Eigen::Vector3d eye{0.0, -3.5, 1.2};
  Eigen::Vector3d target{0.0, 0.0, 0.95};
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double vertical_fov_rad = 0.6;
  double near_m = 0.02;  ///< near clipping plane
};

/// Returns a camera that looks at `target` from `distance_m`. Azimuth 0 is in front of a person (-y
/// of the target), pi/2 at their left (+x), -pi/2 at their right; elevation is above horizontal.
Camera OrbitCamera(const Eigen::Vector3d& target, double azimuth_rad, double elevation_rad,
                   double distance_m);

/// Returns an orbit camera just far enough to see the whole box, with `margin` (a fraction) around
/// it. `aspect` is width / height of the picture.
Camera FitCamera(const Eigen::AlignedBox3d& box, double azimuth_rad, double elevation_rad,
                 double aspect, double margin = 0.06);

/// Returns a close-up camera on one point from the given azimuth and elevation; the picture's
/// height covers `radius_m` around the point.
Camera CloseUpCamera(const Eigen::Vector3d& point, double radius_m, double azimuth_rad,
                     double elevation_rad);

/// A camera for a picture of a given size. Camera frame: +x right, +y down, +z forward; pixel (0,
/// 0) is top left and covers [0, 1) x [0, 1).
class View {
 public:
  /// Throws Error if eye and target coincide, the field of view is not in (0, pi), or the size is
  /// not positive. The viewing direction may be parallel to `up`.
  View(const Camera& camera, int width, int height);

  Eigen::Vector3d ToCamera(const Eigen::Vector3d& x_world) const {
    return camera_from_world_ * (x_world - eye_);
  }
  /// Projects a point in front of the camera to pixel coordinates.
  Eigen::Vector2d Project(const Eigen::Vector3d& x_camera) const {
    return {focal_ * x_camera.x() / x_camera.z() + center_.x(),
            focal_ * x_camera.y() / x_camera.z() + center_.y()};
  }
  /// Direction through a pixel position in the camera frame, z = 1 (not unit length).
  Eigen::Vector3d RayInCamera(double x, double y) const {
    return {(x - center_.x()) / focal_, (y - center_.y()) / focal_, 1.0};
  }

  const Eigen::Matrix3d& CameraFromWorld() const { return camera_from_world_; }
  const Eigen::Vector3d& Eye() const { return eye_; }
  double Focal() const { return focal_; }  ///< pixels
  double Near() const { return near_; }    ///< meters
  int Width() const { return width_; }
  int Height() const { return height_; }

 private:
  Eigen::Matrix3d camera_from_world_;
  Eigen::Vector3d eye_;
  Eigen::Vector2d center_;
  double focal_;
  double near_;
  int width_;
  int height_;
};

}  // namespace holdfast
