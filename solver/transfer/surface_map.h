// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/mesh/surface_distance.h"
#include "solver/transfer/embedded_deformation.h"

namespace holdfast {

/// Quality of a map from the first surface to the second.
struct SurfaceMapReport {
  /// "scaled": the second object is a scaled copy of the first; "registered" by shape; "given":
  /// from point pairs.
  std::string_view method = "scaled";
  double turned_deg = 0.0;  ///< rotation of the first object to align with the second
  Eigen::Vector3d scale =
      Eigen::Vector3d::Ones();  ///< along the first object's axes, before deformation
  double residual_mm = 0.0;     ///< RMS distance of the warped first surface from the second
  double missed_mm = 0.0;       ///< 95th percentile, second surface to the warped first
  double stretch_median = 1.0, stretch_most = 1.0;  ///< max(s, 1/s); median, 95th percentile
  /// Whether the objects are similar: residual below 4 %, missed below 8 % of the second's
  /// diagonal, and stretch (relative to the uniform scale) below 2.5.
  bool alike = true;
};

/// A dense map from one object's surface to another's, and of the surrounding space: it transfers
/// hand contacts. Const and thread-safe.
///
/// Warp(x) = sum_k w_k(y) (R_k (y - g_k) + g_k + t_k),  y = Q diag(s) x + b: rotation and scale per
/// axis, then embedded deformation (Sumner, Schmid, Pauly 2007) by nodes g_k, as rigid as possible:
/// the sum over neighbors |R_k (g_l - g_k) + g_k + t_k - g_l - t_l|^2 is small.
class SurfaceMap {
 public:
  /// Returns the map to the same object scaled about its origin, with a factor per axis. Throws
  /// Error for factors outside [0.05, 20].
  static SurfaceMap Scaled(const TriangleMesh& from, const Eigen::Vector3d& factors);
  /// Registers by shape: many starts (rotations about z, axes of inertia) are ranked by points and
  /// normals, refined (ICP), and the best is deformed. Symmetric objects are not rotated.
  static SurfaceMap Registered(const TriangleMesh& from, const TriangleMesh& to);
  /// Fits the map to pairs of points (3 x n, meters, n >= 4), column k of the first surface to k of
  /// the second. Throws Error for other sizes and points over 2 cm from their surfaces.
  static SurfaceMap Given(const TriangleMesh& from, const TriangleMesh& to,
                          const Eigen::Matrix3Xd& on_from, const Eigen::Matrix3Xd& on_to);
  /// Reads pairs from a text file: a row of six numbers per pair (x y z on the first, x y z on the
  /// second, meters), or one number per vertex of the first, a vertex index of the second, from 0;
  /// separated by blanks or commas, '#' begins a comment. Throws Error for anything else.
  static SurfaceMap FromFile(const TriangleMesh& from, const TriangleMesh& to,
                             const std::filesystem::path& path);

  /// Maps a point on or near the first surface.
  Eigen::Vector3d Warp(const Eigen::Vector3d& point) const;
  /// Rotation of directions at the point.
  Eigen::Matrix3d Turn(const Eigen::Vector3d& point) const;

  struct Image {
    Eigen::Vector3d point;   ///< on the second surface
    Eigen::Vector3d normal;  ///< outward unit normal
  };
  /// Maps a surface point with its outward normal, preserving the side of walls.
  Image At(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;

  /// Pose of the first object in the second's frame when the second replaces it: same orientation,
  /// box centers vertically aligned, standing at the same height.
  const Eigen::Isometry3d& InPlace() const { return to_from_from_; }
  const SurfaceMapReport& Report() const { return report_; }

 private:
  friend class MapFinder;

  SurfaceMap() = default;
  Eigen::Vector3d Placed(const Eigen::Vector3d& point) const { return linear_ * point + offset_; }
  void Measure(const TriangleMesh& from, const TriangleMesh& to);
  void SetInPlace(const TriangleMesh& from, const Eigen::Matrix3Xd& to);

  Eigen::Matrix3d rotation_ = Eigen::Matrix3d::Identity();  // Q
  Eigen::Matrix3d linear_ = Eigen::Matrix3d::Identity();    // Q diag(s)
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();        // b
  std::vector<DeformationNode> nodes_;
  std::shared_ptr<const SignedDistance> to_;  // null: the first object, scaled
  Eigen::Isometry3d to_from_from_ = Eigen::Isometry3d::Identity();
  SurfaceMapReport report_;
};

/// Surface points with their outward normals.
struct OrientedPoints {
  Eigen::Matrix3Xd at, normal;
  Eigen::Index Count() const { return at.cols(); }
};
/// Samples `count` points evenly on the mesh; `surface` is its signed distance.
inline OrientedPoints SampleOriented(const TriangleMesh& mesh, const SignedDistance& surface,
                                     int count) {
  OrientedPoints points{SampleSurface(mesh, count), {}};
  points.normal.resize(3, points.at.cols());
  for (Eigen::Index i = 0; i < points.at.cols(); ++i) {
    points.normal.col(i) = surface.Query(points.at.col(i)).gradient;
  }
  return points;
}

inline Eigen::AlignedBox3d BoxOf(const Eigen::Matrix3Xd& points) {
  return {points.rowwise().minCoeff(), points.rowwise().maxCoeff()};
}

}  // namespace holdfast
