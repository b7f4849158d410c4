// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/io/container/npz.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_certificate.h"

namespace holdfast {

struct GraspSetOptions {
  int count = 100;  ///< grasps that are asked for
  /// Two grasps are distinct when their wrists are this far apart in the object's frame, or turned
  /// by this much against each other. Symmetries of the object are not looked at.
  double apart_m = 0.02;
  double apart_rad = 20.0 * std::numbers::pi / 180.0;
  double max_penetration_m = 0.001;  ///< skin in the object and the object's surface in the hand
  /// Samplings of the surface, each of other places, before fewer grasps than asked for are
  /// returned; it ends as well when one adds less than a fiftieth to those found.
  int samplings = 8;
  /// Style, place, seed, threads, friction, touch distance and the search for places and turns.
  GraspOptions search;
};

/// A grasp, and where it touches: what its certificate is about.
struct CertifiedGrasp {
  Grasp grasp;  ///< with its certificate
  std::vector<GraspContact> contacts;
};

struct GraspSet {
  /// kFound with as many as asked for; kFewer, kStopped with those found; else why there is none.
  GraspStatus status = GraspStatus::kNothingToGrasp;
  std::vector<CertifiedGrasp> grasps;  ///< distinct, best score first
  Eigen::Vector3d mass_center;         ///< object frame, meters
  GraspUse use = GraspUse::kAny;       ///< what the object was taken for
  int samplings = 0, placements = 0, closings = 0, refinements = 0;
  double milliseconds = 0.0;
};

/// Many ways to hold an object in one hand, for robotics: each is in contact, nowhere deeper than
/// `max_penetration_m`, is refused for none of CloseHand's reasons, holds the object's weight in
/// every direction with the friction given (GraspCertificate), and is distinct from all others.
/// Each holds firmly: with a squeeze of six times the weight, and of twelve where the mass center
/// is off by a tenth of the object's size; only where none does, those that hold at all are given.
/// If a use is asked for (GraspOptions::use), each takes the object for it; else those that do as
/// people do, judged by shape, come first. Hands are put to opposed places and handles all over the
/// object, closed and refined, the cheap tests first, until there are enough. The same for any
/// number of threads.
///
/// Throws Error for a mesh that encloses no solid (WhyNotSolid), and for options out of range.
GraspSet FindGrasps(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
                    const GraspSetOptions& options, const GraspProgress& progress = {});

/// Whether two poses of the wrist in the object's frame are distinct.
bool AreDistinct(const Eigen::Isometry3d& wrist_from_object, const Eigen::Isometry3d& other,
                 double apart_m, double apart_rad);

/// A set of N grasps with C contacts in all as arrays by name, as docs/formats.md lists them: poses
/// (N, 4, 4), finger angles (N, 45), qualities (N,), contacts (C, ...) with the grasp of each.
std::map<std::string, NpyArray> GraspSetArrays(const GraspSet& set, const std::string& object,
                                               Side side);

/// The qualities and the wrist's pose as a table: a row for each grasp, best first.
std::string GraspSetCsv(const GraspSet& set);

}  // namespace holdfast
