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
#include "solver/hand/hand_landmarks.h"

namespace holdfast {

struct CertificateOptions {
  double friction = 0.5;  ///< friction coefficient for the wrench ball
  /// Edges of the pyramid inscribed in each friction cone; whatever the pyramids resist, the cones
  /// do too. 8 edges lose up to 8 % of the tangential force.
  int cone_edges = 8;
  double most_squeeze = 100.0;   ///< upper bound on the sum of normal forces, in object weights
  double friction_step = 0.005;  ///< resolution of the least friction
};

/// What contacts resist, proven by linear programs (GLPK's simplex). Each number below follows from
/// a solution that was verified in double precision, not from a search that failed to refute it.
struct GraspCertificate {
  /// Radius of the largest ball around 0 in the convex hull of the wrenches that unit forces in the
  /// friction cones exert (Ferrari & Canny 1992, L1), torques about the mass center divided by
  /// `length_m`. At least `ball_lower`, which is proven, and at most `ball_upper`, which the hull
  /// of the pyramids reaches in one direction. 0 without force closure.
  double ball_lower = 0.0, ball_upper = 0.0;
  /// Least friction coefficient with which contacts balance the object's weight, acting at its mass
  /// center, in every direction; proven for it and all larger ones. None: not up to 2.
  std::optional<double> least_friction;
  double friction = 0.0;  ///< of the ball
  double length_m = 0.0;
  int contacts = 0;
};

/// Certifies contacts of a solid with its mass center at `mass_center` (frame of the contacts,
/// meters). Throws Error for options out of range.
///
/// The balanced loads form a convex cone. Hence all directions of gravity are balanced when four
/// that positively span space are (those of a regular tetrahedron). `most_squeeze` bounds the
/// forces of these four; other directions need at most three times as much. The least friction
/// follows by bisection above the friction that the multipliers of unbalanced loads refute. For the
/// ball, linear programs find how far the hull of the wrenches reaches in 54 directions (the
/// weights of E6 and their opposites); a direction is skipped where pairs that add up to it show
/// that it is not the nearest. The hull of the points reached contains a ball of sqrt(3/8) = 61 %
/// of the least of these distances, so `ball_lower` is at least that fraction of the pyramids' own
/// radius. The facets met there and descent of the support function give `ball_upper`.
GraspCertificate CertifyContacts(std::span<const GraspContact> contacts,
                                 const Eigen::Vector3d& mass_center, double length_m,
                                 const CertificateOptions& options = {});

/// Whether the contacts hold the object's weight in every direction with this friction: the fast
/// part of the certificate (four linear programs).
bool HoldsGravity(std::span<const GraspContact> contacts, const Eigen::Vector3d& mass_center,
                  double length_m, double friction, const CertificateOptions& options = {});
/// The same for every mass center in `mass_centers`.
bool HoldsGravity(std::span<const GraspContact> contacts,
                  std::span<const Eigen::Vector3d> mass_centers, double length_m, double friction,
                  const CertificateOptions& options = {});

/// Contacts of a hand: points of the object's surface, with normals (object frame), where the
/// touching sides of the hand's parts are nearer than `touch_distance_m`. Of points close together
/// on one part, only the nearest is kept (within 6 mm, or more until at most `most` are left). The
/// result is a subset of the contacts, so what is certified for it holds for all of them.
std::vector<GraspContact> PadContacts(const HandAnatomy& anatomy, HandEvaluation& hand,
                                      const DistanceGrid& object, const FingerPose& fingers,
                                      const Eigen::Isometry3d& wrist_from_object,
                                      double touch_distance_m, int most = 32);

/// Why nothing can be certified about a mesh, as a phrase: it is open (holes of more than 5 % of
/// its area) or flat (mean thickness below 0.1 mm). Empty: it encloses a solid.
std::string WhyNotSolid(const TriangleMesh& mesh);

}  // namespace holdfast
