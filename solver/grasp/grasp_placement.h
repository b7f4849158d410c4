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
  kPrecision,  ///< pads of thumb and fingers (Feix et al.: precision)
  kHandle,     ///< fingers through a handle, around its bar
};

/// A hand placed at an object, still open.
struct Placement {
  GraspStyle style;
  Eigen::Isometry3d wrist_from_object;
  HandAngles start;  ///< finger angles to close from
  double width;      ///< of its opposition, meters
  double prior;      ///< expected quality before closing; larger is better
  std::array<bool, kNumFingers> closing = {true, true, true, true, true};  ///< fingers to close
  int handle = -1;  ///< index of the object's handle, for kHandle
};

/// Places one hand at any object. The data of the hand (open and pinch poses with their skin) are
/// computed once; const and shared by threads afterwards.
class GraspPlacer {
 public:
  explicit GraspPlacer(const HandAnatomy& anatomy);

  struct Target {
    const DistanceGrid& object;
    double size;  ///< diagonal of the bounding box, meters
    /// Allowed penetration of a hand before it closes, meters; closing and refinement resolve it. A
    /// small fraction of the thinnest wall, or else hands would be pushed out on its far side.
    double allowed_depth;
  };

  /// Returns all placements of both styles for one opposition with the open hand clear of the
  /// object: rotated in steps about the opposition's axis, in both senses of the axis.
  std::vector<Placement> Place(const Opposition& opposition, const Target& target, int turns) const;

  /// Whether the forearm behind a straight wrist is clear of the object.
  bool ForearmClear(const DistanceGrid& object, const Eigen::Isometry3d& wrist_from_object) const;

 private:
  struct PosedHand {
    HandAngles angles;
    Eigen::Matrix3Xd skin;     // all skin points
    Eigen::Vector3d center;    // between the pads
    Eigen::Vector3d axis;      // from the thumb's pad to the finger pads
    Eigen::Vector3d approach;  // from the palm to the pads, orthogonal to `axis`
    double width;
    // Subsets of `skin`: palmar sides, which meet an object first; palm; all but the thumb; thumb.
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
  std::vector<PosedHand> open_;   // same open fingers, several thumb positions
  std::vector<PosedHand> pinch_;  // by width
};

/// A place where the hand presses on the object, object frame.
struct GraspContact {
  Eigen::Vector3d point;
  Eigen::Vector3d inward;  ///< unit, direction of the pressing force
};

/// Magnitude of the weakest disturbance wrench to be resisted (Ferrari & Canny 1992): radius of the
/// largest ball around the origin within the convex hull of the wrenches of unit forces in the
/// friction cones, torques about `centroid` divided by `length` (meters). 0 without force closure;
/// about 0.1 to 0.5 for firm grasps. Computed by descent over directions from fixed starts: an
/// upper bound, tight in practice, and deterministic.
double WrenchQuality(std::span<const GraspContact> contacts, const Eigen::Vector3d& centroid,
                     double length, double friction = 0.5);

}  // namespace holdfast
