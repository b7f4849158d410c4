// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_axes.h"
#include "solver/hand/hand_evaluation.h"

namespace holdfast {

/// Part of a hand: the 15 phalanges by finger joint, then the palm.
inline constexpr int kPalmPart = kJointsPerHand;
inline constexpr int kNumHandParts = kJointsPerHand + 1;

/// A skin point: a vertex (a == b) or an edge midpoint. Hand vertices are 5-8 mm apart; with the
/// edge midpoints, nothing thicker than about 3 mm passes between the points.
struct SkinPoint {
  int a, b;
  int part;  ///< the part of both ends, or that of `a` if they differ
};

/// A ball inside a finger, centered at the mean of a ring of vertices: fingers are chains of balls.
struct FingerBall {
  int finger_joint;
  std::vector<int> ring;
  double radius;  ///< meters
};

/// Contact and collision geometry of a hand, from rest shape, skinning and bones of any model of
/// SMPL-X's layout: no vertex indices are hard-coded.
class HandLandmarks {
 public:
  HandLandmarks(const HandModel& hand, const HandAxes& axes);

  /// Part with the largest skinning weight of a vertex.
  int PartOf(int vertex) const { return part_of_[vertex]; }
  /// All skin points; vertices come first, in order.
  const std::vector<SkinPoint>& Skin() const { return skin_; }
  /// Skin points of a part, by index, in patches valid for any pose.
  const PointPatches& SkinPatches(int part) const { return skin_patches_[part]; }
  /// Vertices on the touching side of a part; the pad for last phalanges.
  const std::vector<int>& Pad(int part) const { return pads_[part]; }
  /// Vertex at the center of a fingertip's pad, where a pinch meets.
  int PadCenter(int finger) const { return pad_centers_[finger]; }

  const std::vector<FingerBall>& Balls() const { return balls_; }
  /// Pairs of balls that fingers could push into each other, with the minimum free distance of
  /// centers: the sum of radii minus the skin's softness, and at most that of the rest pose.
  struct BallPair {
    int first, second;
    double free_distance;
  };
  const std::vector<BallPair>& BallPairs() const { return ball_pairs_; }
  /// Vertices of the palm's touching side that balls of the last phalanges must not enter.
  const std::vector<int>& PalmSkin() const { return pads_[kPalmPart]; }

  /// Center of the palm's touching side below the finger roots, relative to the wrist, rest pose.
  const Eigen::Vector3d& PalmCenter() const { return palm_center_; }
  /// Radius of the forearm just behind the wrist.
  double ForearmRadius() const { return forearm_radius_; }

 private:
  /// The hand at rest, relative to the wrist.
  struct RestHand {
    const HandAxes& axes;
    Eigen::Matrix3Xd vertices;
    Eigen::Matrix3Xd normals;
  };
  void FindSkin(const HandModel& hand);
  void FindSkinPatches(const RestHand& rest);
  void FindPads(const RestHand& rest);
  void FindPadCenters(const RestHand& rest);
  void FindBalls(const RestHand& rest);
  void FindPalmAndForearm(const RestHand& rest);

  std::vector<int> part_of_;
  std::vector<SkinPoint> skin_;
  std::array<std::vector<int>, kNumHandParts> pads_;
  std::array<int, kNumFingers> pad_centers_{};
  std::vector<FingerBall> balls_;
  std::vector<BallPair> ball_pairs_;
  Eigen::Vector3d palm_center_;
  double forearm_radius_ = 0.03;
  std::array<PointPatches, kNumHandParts> skin_patches_;
};

/// Positions (3 x n) of skin points for vertices in any frame.
void SkinPositions(const HandLandmarks& landmarks, const Eigen::Matrix3Xd& vertices,
                   Eigen::Matrix3Xd& positions);
/// Signed distances (meters) of skin points (`positions` from SkinPositions, in the source frame of
/// `object_from_skin`) to an object; infinity for points whose neighbors show that they are farther
/// than `most_m`.
Eigen::VectorXd SkinDistances(const HandLandmarks& landmarks, const DistanceGrid& object,
                              const Eigen::Isometry3d& object_from_skin,
                              const Eigen::Matrix3Xd& positions, double most_m);
/// Centers (3 x n) of the finger balls.
void BallCenters(const HandLandmarks& landmarks, const Eigen::Matrix3Xd& vertices,
                 Eigen::Matrix3Xd& centers);
/// Maximum overlap of fingers with each other or with the palm, meters; 0 if there is none.
double SelfPenetration(const HandLandmarks& landmarks, const Eigen::Matrix3Xd& vertices);

/// Anatomy of a hand for grasping; const and shared by threads. `model` must outlive it.
struct HandAnatomy {
  explicit HandAnatomy(const HandModel& model) : hand(model), axes(model), landmarks(model, axes) {}

  const HandModel& hand;
  HandAxes axes;
  HandLandmarks landmarks;
};

/// An evaluation with the wrist at the origin, unrotated: world and wrist frame are the same.
HandEvaluation AtWrist(const HandModel& hand);

/// An open hand, fingers nearly parallel and the thumb away from the palm (its angles in degrees).
HandAngles OpenHand(const HandAxes& axes, double thumb_flexion = -15.0,
                    double thumb_abduction = 25.0);
/// A hand about to pinch an object `width` meters thick: pads of the thumb and of the index and
/// middle finger face each other at that distance. Solved by least squares for this hand.
HandAngles PinchHand(const HandAnatomy& anatomy, double width);

}  // namespace holdfast
