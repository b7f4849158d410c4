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

/// Where a map comes from.
enum class MapMethod {
  kScaled,      ///< the second object is the first one, scaled
  kRegistered,  ///< found by shape
  kGiven,       ///< by pairs of points
};
std::string_view MethodName(MapMethod method);

/// How well a map carries the first surface onto the second.
struct SurfaceMapReport {
  MapMethod method = MapMethod::kScaled;
  double turned_deg = 0.0;  ///< by which the first object turns to lie like the second
  Eigen::Vector3d scale =
      Eigen::Vector3d::Ones();  ///< along the first object's axes, before it bends
  double residual_mm = 0.0;  ///< root mean square distance of the first, carried, from the second
  double missed_mm = 0.0;    ///< 95th percentile of the second's from the first, carried
  double stretch_median = 1.0, stretch_most = 1.0;  ///< max(s, 1/s); median, 95th percentile
  /// Whether the two are of one kind: residual below 4 %, missed below 8 % of the second's
  /// diagonal, and stretch (over the uniform scale) below 2.5.
  bool alike = true;
};

struct SurfaceMapOptions {
  int samples = 1500;  ///< points on each surface that are matched
  int nodes = 70;      ///< of the graph that bends
};

/// A dense map of one object's surface onto another's, and of the space around it: contacts of a
/// hand go along. Const and shared by threads.
///
/// Warp(x) = sum_k w_k(y) (R_k (y - g_k) + g_k + t_k),  y = Q diag(s) x + b: rotation and scale per
/// axis, then embedded deformation (Sumner, Schmid, Pauly 2007) by nodes g_k, kept as rigid as
/// possible: the sum over neighbors |R_k (g_l - g_k) + g_k + t_k - g_l - t_l|^2 is small.
class SurfaceMap {
 public:
  /// Onto the same object scaled about its origin, by a factor for each axis. Throws Error unless
  /// they are in [0.05, 20].
  static SurfaceMap Scaled(const TriangleMesh& from, const Eigen::Vector3d& factors);
  /// Found by shape: many starts (turns about z, axes of inertia), the nearest by points and
  /// normals, iterated (ICP) and then bent. Objects that turning leaves alike stay as they are.
  static SurfaceMap Registered(const TriangleMesh& from, const TriangleMesh& to,
                               const SurfaceMapOptions& options = {});
  /// By pairs of points (3 x n, meters, n >= 4), the k-th of the first surface on the k-th of the
  /// second. Throws Error for other sizes and points farther than 2 cm from their surfaces.
  static SurfaceMap Given(const TriangleMesh& from, const TriangleMesh& to,
                          const Eigen::Matrix3Xd& on_from, const Eigen::Matrix3Xd& on_to,
                          const SurfaceMapOptions& options = {});
  /// The same of a text file: a row of six numbers for each pair (x y z on the first, x y z on the
  /// second, meters), or one number for each vertex of the first, a vertex of the second, from 0;
  /// blanks or commas between, '#' begins a comment. Throws Error for anything else.
  static SurfaceMap FromFile(const TriangleMesh& from, const TriangleMesh& to,
                             const std::filesystem::path& path,
                             const SurfaceMapOptions& options = {});

  /// Where a point on or near the first surface goes.
  Eigen::Vector3d Warp(const Eigen::Vector3d& point) const;
  /// How directions turn there.
  Eigen::Matrix3d Turn(const Eigen::Vector3d& point) const;

  struct Image {
    Eigen::Vector3d point;   ///< on the second surface
    Eigen::Vector3d normal;  ///< unit, outwards
  };
  /// Of a point of the first surface with its outward normal: on the side of walls that it is on.
  Image At(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;

  /// The first object's frame in the second's where the second takes the first one's place:
  /// turned alike, centers of the boxes above each other, standing at the same height.
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
  std::shared_ptr<const SignedDistance> to_;  // null: the first one, scaled
  Eigen::Isometry3d to_from_from_ = Eigen::Isometry3d::Identity();
  SurfaceMapReport report_;
};

/// Points of a surface with their outward normals.
struct OrientedPoints {
  Eigen::Matrix3Xd at, normal;
  Eigen::Index Count() const { return at.cols(); }
};
/// `count` points, evenly over the mesh; `surface` is its distance.
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
