// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "solver/grasp/grasp_placement.h"
#include "solver/hand/hand_postures.h"

namespace holdfast {

struct CertificateOptions {
  double friction = 0.5;  ///< coefficient that the wrench ball is for
  /// Edges of the pyramid within each friction cone: inscribed, so that what the pyramids resist
  /// the cones do too. 8 edges lose up to 8 % of the tangential force.
  int cone_edges = 8;
  /// Lever (meters) of the twisting moment about its normal that a contact resists as well:
  /// friction * lever * normal force. 0: points, as where several contacts stand for one pad.
  double twist_lever_m = 0.0;
  double most_squeeze = 100.0;   ///< sum of the normal forces that hold, in weights of the object
  double most_friction = 2.0;    ///< beyond it a grasp counts as one that no friction helps
  double friction_step = 0.005;  ///< how exact the least friction is
};

/// What contacts resist, proven by linear programs (GLPK's simplex): each number below is what a
/// solution that was checked in double precision shows, not what a search failed to refute.
struct GraspCertificate {
  /// Radius of the largest ball of wrenches around 0 in the convex hull of those that unit forces
  /// in the friction cones exert (Ferrari & Canny 1992, L1), torques about the mass center divided
  /// by `length_m`: at least `ball_lower`, which is proven, and at most `ball_upper`, which the
  /// hull of the pyramids reaches in one direction. 0 without force closure.
  double ball_lower = 0.0, ball_upper = 0.0;
  /// Least friction coefficient with which contacts balance the object's weight, pulling at its
  /// mass center, in every direction; proven for it and all above. None: not up to
  /// `CertificateOptions::most_friction`.
  std::optional<double> least_friction;
  double friction = 0.0;  ///< of the ball
  double length_m = 0.0;
  int contacts = 0;

  bool HoldsWith(double coefficient) const {
    return least_friction && *least_friction <= coefficient;
  }
};

/// Certifies contacts of a solid whose mass center is at `mass_center` (frame of the contacts,
/// meters). Throws Error for options out of range.
///
/// The balanced loads are a convex cone, so all directions of gravity are held when four that span
/// space positively are (a regular tetrahedron's); the least friction follows by bisection
/// above what the multipliers of loads that are not held refute. Of the ball, linear programs find
/// how far the hull of the wrenches reaches in 54 directions (the weights of E6 and their
/// opposites), where pairs that add up to one do not show that it is not the nearest; the hull of
/// what they reach contains a ball of sqrt(3/8) = 61 % of the least of these distances, so
/// `ball_lower` is at least that share of the pyramids' own radius. The facets met there and
/// descent of the support function give `ball_upper`.
GraspCertificate CertifyContacts(std::span<const GraspContact> contacts,
                                 const Eigen::Vector3d& mass_center, double length_m,
                                 const CertificateOptions& options = {});

/// Whether the contacts hold the object's weight in every direction with this friction: the quick
/// part of the certificate (four linear programs).
bool HoldsGravity(std::span<const GraspContact> contacts, const Eigen::Vector3d& mass_center,
                  double length_m, double friction, const CertificateOptions& options = {});
/// The same wherever of `mass_centers` its mass center is.
bool HoldsGravity(std::span<const GraspContact> contacts,
                  std::span<const Eigen::Vector3d> mass_centers, double length_m, double friction,
                  const CertificateOptions& options = {});

/// Where the touching sides of a hand's parts are nearer to the object than `touch_distance_m`:
/// points of its surface and its normals, object frame. Of points that are close together on one
/// part the nearest stands for all (6 mm, farther until at most `most` are left): a subset of the
/// contacts, so that what is certified for it holds for all of them.
std::vector<GraspContact> PadContacts(const HandAnatomy& anatomy, HandEvaluation& hand,
                                      const DistanceGrid& object, const FingerPose& fingers,
                                      const Eigen::Isometry3d& wrist_from_object,
                                      double touch_distance_m, int most = 32);

/// Why nothing can be certified about a mesh, as a phrase: it is open (holes of more than 5 % of
/// its area) or flat (less than 0.1 mm thick on average). Empty: it encloses a solid.
std::string WhyNotSolid(const TriangleMesh& mesh);

}  // namespace holdfast
