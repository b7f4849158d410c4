// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "solver/grasp/finger_closing.h"
#include "solver/grasp/grasp_candidates.h"

namespace holdfast {

enum class GraspStyle {
  kPower,      ///< object in the palm, fingers around it (Feix et al.: power)
  kPrecision,  ///< pads of the thumb and the fingers (precision)
  kHandle,     ///< fingers through a handle, round its bar
};

/// A hand put to an object, still open.
struct Placement {
  GraspStyle style;
  Eigen::Isometry3d wrist_from_object;
  HandAngles start;  ///< finger angles to close from
  double width;      ///< of the opposition it is made for, meters
  double prior;      ///< how promising, before closing: larger is better
  std::array<bool, kNumFingers> closing = {true, true, true, true, true};  ///< those that close
  int handle = -1;  ///< which of the object's, for kHandle
};

/// Puts one hand to any object. The hand's own part (open and pinching poses with their skin) is
/// worked out once; const and shared by threads afterwards.
class GraspPlacer {
 public:
  explicit GraspPlacer(const HandAnatomy& anatomy);

  struct Target {
    const DistanceGrid& object;
    double size;  ///< diagonal of the bounding box, meters
    /// How deep a hand may be in the object before it closes, meters: closing and refinement free
    /// it. A small part of the thinnest wall, or hands would be freed to its far side.
    double allowed_depth;
  };

  /// All placements of both styles for one opposition that have the open hand clear of the object:
  /// turned about the opposition's axis in steps, either way round.
  std::vector<Placement> Place(const Opposition& opposition, const Target& target, int turns) const;

  /// Whether the forearm behind a straight wrist is clear of the object.
  bool ForearmClear(const DistanceGrid& object, const Eigen::Isometry3d& wrist_from_object) const;

 private:
  struct PosedHand {
    HandAngles angles;
    Eigen::Matrix3Xd skin;     // every skin point
    Eigen::Vector3d center;    // between the pads
    Eigen::Vector3d axis;      // from the thumb's pad to the fingers'
    Eigen::Vector3d approach;  // from the palm to the pads, orthogonal to `axis`
    double width;
    // Of `skin`: what meets an object first, the palm's touching side, all but the thumb, and it.
    PointPatches palm_side, palm, fingers, thumb;
  };

  void FindPatches(PosedHand& posed) const;
  PosedHand Posed(const HandAngles& angles) const;
  void PlacePower(const Opposition& opposition, const Eigen::Vector3d& axis,
                  const Eigen::Vector3d& approach, const Target& target,
                  std::vector<Placement>& placements) const;
  void PlacePrecision(const Opposition& opposition, const Eigen::Vector3d& axis,
                      const Eigen::Vector3d& approach, const Target& target,
                      std::vector<Placement>& placements) const;

  const HandAnatomy& anatomy_;
  std::vector<PosedHand> open_;   // the same open fingers, thumbs in several places
  std::vector<PosedHand> pinch_;  // by width
};

/// A place where the hand presses on the object, object frame.
struct GraspContact {
  Eigen::Vector3d point;
  Eigen::Vector3d inward;  ///< unit, the direction of the pressing force
};

/// How hard the weakest disturbance is to resist (Ferrari & Canny 1992): the radius of the largest
/// ball around the origin within the convex hull of the wrenches that unit forces within the
/// friction cones exert, torques taken about `centroid` and divided by `length` (meters). 0 without
/// force closure; about 0.1 to 0.5 for firm grasps. The ball is found by descent over directions
/// from fixed starts: an upper bound, tight in practice, and deterministic.
double WrenchQuality(std::span<const GraspContact> contacts, const Eigen::Vector3d& centroid,
                     double length, double friction = 0.5);

}  // namespace holdfast
