// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"

namespace holdfast {

struct FootLiftOptions {
  double lift_m = 0.27;         ///< of the higher of heel and ball, in a long stride
  double long_stride_m = 0.8;   ///< shorter strides are lifted in proportion
  double least_stride_m = 0.3;  ///< shorter steps are not strides
  double most_bend_rad = 0.7;   ///< added to the knee
};

/// Lifts feet that hardly leave the ground as in natural walking: during a step with the other foot
/// in stance, the knee bends more, which raises the heel behind. Both ends of a step and feet that
/// are high already are unchanged. `contacts`: from FindSupports, as long as `frames`.
void LiftFeet(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
              const std::vector<SoleBits>& contacts, std::vector<BodyFrame>& frames,
              const FootLiftOptions& options = {});

/// Pins stance feet frame by frame: the online version of LockFeet, without knowledge of the next
/// frame. At least one foot is in stance unless both are off the ground: a stance begins when the
/// foot is low and slow (under 4 cm, 0.5 m/s horizontally) and ends when it is high or fast (6 cm,
/// 1 m/s). In stance the ball (else the heel) keeps its position and the lower of them is at z = 0;
/// in the air the foot returns to its input motion. A foot dragged farther than 6 cm takes a small
/// step if the other is in stance. A stance foot keeps its heading. Toes near the ground bend up
/// instead of pointing into it, as under a raised heel. The pelvis is lowered, by at most 10 cm,
/// where legs do not reach.
class FootPinner {
 public:
  /// `rest_joints` (3 x 55) is copied; in the rest pose the soles are at y = `sole_y`. Meters.
  FootPinner(Eigen::Matrix3Xd rest_joints, double sole_y);

  /// Corrects the next frame, 1/30 s after the previous one, in place.
  void Pin(BodyFrame& frame);
  /// Drag of the stance foot beyond 3 cm: the displacement by which the motion should be moved back
  /// (horizontal, meters) and passed to `Follow`.
  Eigen::Vector2d Drag() const;
  /// Declares that later frames are displaced by `moved`; feet on the ground stay.
  void Follow(const Eigen::Vector2d& moved);

 private:
  static constexpr double kFrameRate = 30.0;
  static constexpr double kLow = 0.04, kHigh = 0.06;  // meters
  static constexpr double kSlow = 0.5, kFast = 1.0;   // m/s
  static constexpr double kAirborne = 0.12;           // meters: no foot is in stance
  static constexpr double kFarthest = 0.06;           // meters: a foot dragged farther takes a step
  static constexpr double kMaxYaw = 0.35;             // radians: so does a foot rotated farther
  static constexpr double kGivesWay = 0.03;           // meters: tolerated drag
  static constexpr int kStep = 8;                     // frames of that step
  static constexpr int kFadeIn = 10;                  // frames
  static constexpr int kMinStance = 4;                // frames
  static constexpr double kLift = 0.04;               // meters, in the middle of a small step
  static constexpr double kClearance = 0.03;          // meters, of a foot at full speed
  static constexpr double kBack = 0.8;    // fraction of a correction left after a frame in the air
  static constexpr double kRise = 0.015;  // meters per frame: of a correction's height
  static constexpr double kMaxSink = 0.10;                  // meters
  static constexpr double kSinkIn = 0.02, kSinkOut = 0.01;  // meters per frame

  struct Foot {
    bool stands = false;
    int frames = 0;  // since that changed
    int steps = 0;   // remaining frames of a small step
    Eigen::Vector3d correction = Eigen::Vector3d::Zero();
    double yaw = 0.0;  // correction of its heading
  };
  bool CanStand(int foot) const;
  void Choose();
  void Correct(int foot);

  Eigen::Matrix3Xd rest_joints_;
  SolePoints soles_;
  int frame_ = 0;
  Soles last_, now_;                   // of the input motion
  std::array<double, 2> lowest_ = {};  // meters
  std::array<double, 2> speed_ = {};   // m/s
  std::array<Eigen::Vector2d, 2> drift_;
  std::array<double, 2> heading_ = {},
                        turn_ = {};  // radians, about the vertical; since the last frame
  std::array<Foot, 2> feet_;
  double sink_ = 0.0;
};

/// Levels toes that point into the ground: they bend up, fully while the ball is less than 3 cm
/// above the ground, decreasing to zero at 10 cm, as under a raised heel. Otherwise toe tips would
/// brush the ground in the next step. `share` of the bend is applied, limited so that toes end
/// within `most_rad` of their rest pose.
void LevelToes(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles, double share,
               BodyFrame& frame, double most_rad = std::numbers::pi);

}  // namespace holdfast
