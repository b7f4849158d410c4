// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "generator/matching/leg_placement.h"

namespace holdfast {

struct FootLiftOptions {
  double lift_m = 0.27;         ///< of the higher of heel and ball, in a long stride
  double long_stride_m = 0.8;   ///< shorter ones are lifted in proportion
  double least_stride_m = 0.3;  ///< what is shorter is no stride
  double most_bend_rad = 0.7;   ///< of the knee, added
};

/// Feet that hardly leave the ground are lifted as those of people who walk: in a step of a foot
/// while the other carries, the knee bends more, so that the heel comes up behind; nothing changes
/// at either end of the step, nor where the foot is high already. `contacts` as FindSupports has
/// them, as long as `frames`.
void LiftFeet(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
              const std::vector<SoleBits>& contacts, std::vector<BodyFrame>& frames,
              const FootLiftOptions& options = {});

/// Feet that stand stay where they are, frame by frame: what LockFeet is to a whole motion, for one
/// whose next frame is not known. One foot at least carries, unless both are off the ground: low
/// and slow (under 4 cm, 0.5 m/s along the ground) begins a stance, high or fast (6 cm, 1 m/s) ends
/// it. In a stance the ball (else the heel) stays in its place and the lower of them on z = 0; in
/// the air the foot goes back to where the motion has it. A foot dragged farther than 6 cm makes a
/// small step where the other carries. A foot that stands keeps the way it points. Toes near the
/// ground do not point into it: they bend up, as under a heel that is raised. The pelvis sinks, by
/// 10 cm at most, where legs would not reach.
class FootPinner {
 public:
  /// `rest_joints` (3 x 55) is copied; the soles stand at y = `sole_y` in the rest pose. Meters.
  FootPinner(Eigen::Matrix3Xd rest_joints, double sole_y);

  /// The next frame, 1/30 s after the one before, in place.
  void Pin(BodyFrame& frame);
  /// How far the ground has to move for the foot that carries not to be dragged by more than
  /// 3 cm: the motion is to be moved back so far (horizontal, meters), and `Follow` told.
  Eigen::Vector2d Drag() const;
  /// Frames from now on are moved by that much, feet on the ground stay.
  void Follow(const Eigen::Vector2d& moved);

 private:
  static constexpr double kFrameRate = 30.0;
  static constexpr double kLow = 0.04, kHigh = 0.06;  // meters
  static constexpr double kSlow = 0.5, kFast = 1.0;   // m/s
  static constexpr double kAirborne = 0.12;           // meters: nothing carries
  static constexpr double kFarthest = 0.06;           // meters: a foot dragged farther makes a step
  static constexpr double kMaxYaw = 0.35;             // radians: so does one turned farther
  static constexpr double kGivesWay = 0.03;           // meters: so far the motion is left alone
  static constexpr int kStep = 8;                     // frames of that step
  static constexpr int kFadeIn = 10;                  // frames
  static constexpr int kMinStance = 4;                // frames
  static constexpr double kLift = 0.04;               // meters, half-way through a small step
  static constexpr double kClearance = 0.03;          // meters, of a foot at full speed
  static constexpr double kBack = 0.8;      // of a correction is left after a frame in the air
  static constexpr double kRise = 0.015;    // meters a frame: of a correction's height
  static constexpr double kMaxSink = 0.10;  // meters
  static constexpr double kSinkIn = 0.02, kSinkOut = 0.01;  // meters a frame

  struct Foot {
    bool stands = false;
    int frames = 0;  // since that changed
    int steps = 0;   // frames left of a small step
    Eigen::Vector3d correction = Eigen::Vector3d::Zero();
    double yaw = 0.0;  // correction of the way that it points
  };
  bool CanStand(int foot) const;
  void Choose();
  void Correct(int foot);

  Eigen::Matrix3Xd rest_joints_;
  SolePoints soles_;
  int frame_ = 0;
  Soles last_, now_;                   // as the motion has them
  std::array<double, 2> lowest_ = {};  // meters
  std::array<double, 2> speed_ = {};   // m/s
  std::array<Eigen::Vector2d, 2> drift_;
  std::array<double, 2> heading_ = {}, turn_ = {};  // radians, about the vertical; since the last
  std::array<Foot, 2> feet_;
  double sink_ = 0.0;
};

/// Toes near the ground do not point into it: they bend up until they are level, all of it while
/// the ball is less than 3 cm above the ground and nothing from 10 cm on, as under a heel that is
/// raised. Tips that point down would brush the ground in the next step. `share` of the bend is
/// made, and so much of it that toes are not farther than `most_rad` from their rest afterwards.
void LevelToes(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles, double share,
               BodyFrame& frame, double most_rad = std::numbers::pi);

}  // namespace holdfast
