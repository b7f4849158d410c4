// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/score/contact_metrics.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_handle.h"
#include "solver/grasp/grasp_place.h"
#include "solver/grasp/grasp_use.h"
#include "solver/terms/hand/penetration.h"

namespace holdfast {

/// A hand's surface, closed at the wrist, in any posture: moved there, not made anew. Shared by
/// threads.
class ClosedHands {
 public:
  explicit ClosedHands(const HandModel& hand);

  /// The points (3 x n, frame of the vertices; patches that were made of them in any frame) that
  /// are in the hand whose vertices these are, with the skin over each: below the wrist's closed
  /// opening that has corners that the hand has not.
  struct Inside {
    double depth;  ///< meters
    Intrusion over;
  };
  std::vector<Inside> FindInside(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xd& points,
                                 const PointPatches& patches) const;

 private:
  HoleFill fill_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<SignedDistance>> idle_;
};

/// What grasps of one search are judged against; const, shared by its threads.
struct GraspScene {
  GraspScene(const HandAnatomy& hand, const GraspPlacer& hand_placer, const DistanceGrid& distance,
             const TriangleMesh& mesh, const GraspOptions& search_options);

  /// Fills `handles`: those that may be held by the options' place.
  void LookForHandles();
  /// Sets `use`, and `held_at` with it. Of a place asked for the use says nothing.
  void TakeFor(ObjectUse found);

  const HandAnatomy& anatomy;
  const GraspPlacer& placer;
  const DistanceGrid& object;
  Eigen::Vector3d centroid;
  Eigen::Vector3d held_at;   ///< where hands are wanted: the centroid, or the place asked for
  double size;               ///< diagonal of the bounding box, meters
  double bottom, height;     ///< least z, extent in z, meters
  double tallness;           ///< in (0, 1]: how much it matters which way up the object is
  Eigen::Matrix3Xd surface;  ///< points all over the object (3 x n)
  PointPatches surface_patches;
  ClosedHands hands;
  std::vector<Handle> handles;
  ObjectUse use;
  const GraspOptions& options;
  WristObstacles obstacles;  ///< the options'
};

/// A closed hand, not yet judged.
struct GraspAttempt {
  GraspStyle style = GraspStyle::kPower;
  HandAngles angles = HandAngles::Zero();
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
  int handle = -1;                                         ///< which of the scene's, for kHandle
  double rank = -std::numeric_limits<double>::infinity();  ///< its score before refinement
};

/// Cosine of the object's up with the nearest of the options' ups; 0 where none is given.
double Uprightness(const GraspScene& scene, const Eigen::Isometry3d& wrist_from_object);

/// What is gained by an object that is that upright, by what it is for.
double UprightScore(const GraspScene& scene, GraspStyle style, double upright);

/// Share of the options' obstacle poses in which a point is deeper than soft tissue in the object.
double Blocked(const GraspScene& scene, const Eigen::Isometry3d& wrist_from_object);

/// Measures and scores a hand: firm (wrench quality, fingers pressing against the thumb or the
/// palm, forces that cancel, near the centroid), clean (depths), comfortable, the right way up, and
/// where and how people take such an object (ObjectUse).
/// `thorough` adds the object's surface in the hand, which is slow.
Grasp Assess(const GraspScene& scene, HandEvaluation& hand, const GraspAttempt& attempt,
             bool thorough);

/// How hand and object go through each other, as a phrase; empty where they do not.
std::string WhyThrough(const GraspScene& scene, const Grasp& grasp);
/// Why a thoroughly assessed grasp may not be returned, as a phrase; empty when it may.
std::string WhyRefused(const GraspScene& scene, const Grasp& grasp);

}  // namespace holdfast
