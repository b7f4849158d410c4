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
#include "solver/grasp/grasp_placement.h"
#include "solver/grasp/grasp_use.h"
#include "solver/terms/hand/penetration.h"

namespace holdfast {

/// Surface of a hand, closed at the wrist, in any posture. Its distance structure is updated, not
/// rebuilt. Shared by threads.
class ClosedHands {
 public:
  explicit ClosedHands(const HandModel& hand);

  /// A point inside the hand, with the skin triangle over it; below the closed wrist opening, the
  /// triangle has corners that are not hand vertices. FindInside() returns those of `points` (3 x
  /// n, frame of `vertices`) that lie inside; `patches` were made of the same points, in any frame.
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

/// What the grasps of one search are assessed against. Const; shared by the threads of the search.
struct GraspScene {
  GraspScene(const HandAnatomy& hand, const GraspPlacer& hand_placer, const DistanceGrid& distance,
             const TriangleMesh& mesh, const GraspOptions& search_options);

  /// Sets `use` and `held_at`. Where a region, a point or a part to avoid is given, drops the
  /// location constraints of `use`. Balls to avoid become regions to keep free.
  void TakeFor(ObjectUse found);

  const HandAnatomy& anatomy;
  const GraspPlacer& placer;
  const DistanceGrid& object;
  Eigen::Vector3d centroid;
  Eigen::Vector3d held_at;   ///< preferred grasp center: the centroid or the requested place
  double size;               ///< diagonal of the bounding box, meters
  double bottom, height;     ///< least z and extent in z, meters
  double tallness;           ///< in (0, 1]: importance of the object's up direction
  Eigen::Matrix3Xd surface;  ///< points sampled over the object (3 x n)
  PointPatches surface_patches;
  ClosedHands hands;
  std::vector<Handle> handles;
  ObjectUse use;
  const GraspOptions& options;
  WristObstacles obstacles;  ///< of the options
};

/// A closed hand, not yet assessed.
struct GraspAttempt {
  GraspStyle style = GraspStyle::kPower;
  HandAngles angles = HandAngles::Zero();
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
  int handle = -1;                                         ///< index into `handles`, for kHandle
  double rank = -std::numeric_limits<double>::infinity();  ///< score before refinement
};

/// Cosine of the object's up with the nearest of the options' up directions; 0 if none is given.
double Uprightness(const GraspScene& scene, const Eigen::Isometry3d& wrist_from_object);

/// Score term for the object's uprightness, depending on its use.
double UprightScore(const GraspScene& scene, GraspStyle style, double upright);

/// Fraction of the obstacle poses in which a point is deeper in the object than soft tissue allows.
double Blocked(const GraspScene& scene, const Eigen::Isometry3d& wrist_from_object);

/// Measures and scores a hand. The score rewards firm grasps (wrench quality, fingers pressing
/// against the thumb or the palm, forces that cancel, contacts near the centroid), small
/// penetration, comfort, the object upright, and agreement with how people grasp such an object
/// (ObjectUse). `thorough` adds the object surface inside the hand, which is slow.
Grasp Assess(const GraspScene& scene, HandEvaluation& hand, const GraspAttempt& attempt,
             bool thorough);

/// Describes how hand and object penetrate each other, as a phrase; empty if they do not.
std::string WhyThrough(const GraspScene& scene, const Grasp& grasp);
/// Why a thoroughly assessed grasp is rejected, as a phrase; empty if it is accepted.
std::string WhyRefused(const GraspScene& scene, const Grasp& grasp);

}  // namespace holdfast
