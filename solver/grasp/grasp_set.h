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
  int count = 100;  ///< requested number of grasps
  /// Two grasps are distinct if their wrists differ by this distance or this rotation in the object
  /// frame. Symmetries of the object are ignored.
  double apart_m = 0.02;
  double apart_rad = 20.0 * std::numbers::pi / 180.0;
  double max_penetration_m = 0.001;  ///< skin in object, and object surface in the hand
  /// Maximum number of surface samplings, each at new places, before fewer grasps than requested
  /// are returned. The search also ends when one adds less than 1/50 to the grasps found.
  int samplings = 8;
  /// Style, place, seed, threads, friction, touch distance and the search for places and turns.
  GraspOptions search;
};

/// A grasp with its contacts, which its certificate is about.
struct CertifiedGrasp {
  Grasp grasp;  ///< with its certificate
  std::vector<GraspContact> contacts;
};

struct GraspSet {
  /// kFound: as many as requested; kFewer, kStopped: those found; else why there is none.
  GraspStatus status = GraspStatus::kNothingToGrasp;
  std::vector<CertifiedGrasp> grasps;  ///< distinct, best score first
  Eigen::Vector3d mass_center;         ///< object frame, meters
  GraspUse use = GraspUse::kAny;       ///< assumed use of the object
  int samplings = 0, placements = 0, closings = 0, refinements = 0;
  double milliseconds = 0.0;
};

/// Finds many grasps of an object with one hand, for robotics. Each grasp is in contact, penetrates
/// nowhere deeper than `max_penetration_m`, passes all of CloseHand's checks, holds the object's
/// weight in every direction with the given friction (GraspCertificate), and is distinct from all
/// others. Each holds firmly: with a squeeze of six times the weight, and of twelve with the mass
/// center off by a tenth of the object's size. Only if none is firm, grasps that hold at all are
/// returned. If a use is requested (GraspOptions::use), each grasp suits it; otherwise grasps as
/// people do them, judged by shape, come first. Hands are placed at antipodal pairs and handles all
/// over the object, closed and refined, with the cheap tests first, until there are enough. The
/// result does not depend on the number of threads.
///
/// Throws Error for a mesh that encloses no solid (WhyNotSolid), and for options out of range.
GraspSet FindGrasps(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
                    const GraspSetOptions& options, const GraspProgress& progress = {});

/// Whether two poses of the wrist in the object frame are distinct.
bool AreDistinct(const Eigen::Isometry3d& wrist_from_object, const Eigen::Isometry3d& other,
                 double apart_m, double apart_rad);

/// Named arrays of N grasps with C contacts in total, as listed in docs/formats.md: poses (N, 4,
/// 4), finger angles (N, 45), qualities (N,), contacts (C, ...) with the grasp index of each.
std::map<std::string, NpyArray> GraspSetArrays(const GraspSet& set, const std::string& object,
                                               Side side);

/// Returns qualities and wrist poses as CSV: one row per grasp, best first.
std::string GraspSetCsv(const GraspSet& set);

}  // namespace holdfast
