// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/triangle_tree.h"
#include "solver/grasp/finger_closing.h"
#include "solver/grasp/grasp_candidates.h"
#include "solver/hand/hand_evaluation.h"

namespace holdfast {

/// Where on an object a hand is to grasp: a part of its surface, near a point, or both. Const and
/// shared by threads.
class GraspPlace {
 public:
  struct Ball {
    Eigen::Vector3d center;
    double radius;
  };
  /// The request, in the object frame, meters.
  struct Wanted {
    TriangleMesh region;                ///< part of the surface for contacts; empty: all
    TriangleMesh avoid;                 ///< part of the surface without contacts
    std::optional<Eigen::Vector3d> at;  ///< grasp both sides of the material here
    /// Maximum width to grasp, with one hand or between both.
    double span_m = OppositionOptions{}.max_width_m;
    std::vector<Ball> avoid_balls = {};  ///< no skin here, not even without contact
  };
  static constexpr double kFarthestOff_m = 0.03;  ///< maximum distance of `at` from the surface
  static constexpr double kReach_m = 0.05;  ///< maximum distance of the mean contact from Center()
  static constexpr double kMaxOutside = 0.1;  ///< maximum fraction of contacts outside

  /// Throws Error for a region that is not part of the object or is empty, for a point farther than
  /// `kFarthestOff_m` from the surface, and for a ball that does not reach the surface.
  GraspPlace(const TriangleMesh& object, const Wanted& wanted);

  /// Whether a point on (or near) the surface is in the region.
  bool InRegion(const Eigen::Vector3d& point) const;
  /// Whether it is in the region and near enough to `at`.
  bool Allows(const Eigen::Vector3d& point) const;

  /// The faces of the region, with all vertices of the object.
  const TriangleMesh& Surface() const { return surface_; }
  const std::optional<Eigen::Vector3d>& At() const { return at_; }
  /// Whether the request has a region, a point or a part to avoid; else only balls are avoided.
  bool IsRequired() const { return required_; }
  const std::vector<Ball>& Avoided() const { return balls_; }
  /// Center of the material at `at`, else of the region.
  const Eigen::Vector3d& Center() const { return center_; }

 private:
  TriangleTree tree_;          // of the whole object
  std::vector<bool> allowed_;  // per face
  TriangleMesh surface_;
  std::optional<Eigen::Vector3d> at_;
  std::vector<Ball> balls_;
  bool required_;
  Eigen::Vector3d center_;
  double reach_ = 0.0;  // maximum distance of contacts from `center_`
};

/// Body vertices that do not move with these hands and forearms.
std::vector<int> AwayFromHands(const BodySurface& body, std::span<const Side> sides);

/// Body vertices around the wrist in up to `num_frames` frames spread over a clip: those within
/// `reach_m` of the wrist, in the wrist frame, meters (3 x n, one set per frame). The hand and
/// forearm of `side` are excluded, and those of the other side too if `other_hand` is false, for an
/// object that both hands touch. Meant for GraspOptions::obstacles_in_wrist: an object carried
/// through the clip should not pass through a leg.
std::vector<Eigen::Matrix3Xd> BodyAroundWrist(const Clip& clip, const BodySurface& body, Side side,
                                              double reach_m, int num_frames = 8,
                                              bool other_hand = true);

/// Sets of such points in patches, for many poses of one object. Const; shared by threads.
class WristObstacles {
 public:
  /// `in_wrist` must outlive this.
  explicit WristObstacles(std::span<const Eigen::Matrix3Xd> in_wrist);

  /// Fraction of the sets with a point deeper in the object than soft tissue allows; 0 if there are
  /// none.
  double ShareBlocked(const DistanceGrid& object, const Eigen::Isometry3d& wrist_from_object) const;

 private:
  std::span<const Eigen::Matrix3Xd> sets_;
  std::vector<PointPatches> patches_;  // of each set
};

/// Names: StyleName.
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
