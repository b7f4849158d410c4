// SPDX-License-Identifier: MIT
#pragma once

/// Motion from one skeleton to another: a SourceMotion on any named skeleton comes in and a clip
/// comes out, or the other way round; parameters are converted between body models.

#include <array>
#include <string_view>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {

/// The body that a motion is brought onto.
struct RetargetBody {
  Eigen::Matrix3Xd rest_joints;  ///< (3 x 55) meters, rest pose (y up), as BodyModel::RestJoints
  double floor_y = 0;            ///< ground under the rest pose: lowest vertex, meters
  Eigen::Matrix<double, kHandDofs, 1> left_hand =
      Eigen::Matrix<double, kHandDofs, 1>::Zero();  ///< fingers where the source has none, radians
  Eigen::Matrix<double, kHandDofs, 1> right_hand = Eigen::Matrix<double, kHandDofs, 1>::Zero();
};

/// A model's body of this shape, with its mean hands.
RetargetBody RetargetBodyOf(const BodyModel& model, const Eigen::VectorXd& betas = {});

/// The axis that points up in the world of a motion.
enum class UpAxis { kX, kMinusX, kY, kMinusY, kZ, kMinusZ };

/// "z", "-y", ...
std::string_view UpAxisName(UpAxis up);

struct RetargetOptions {
  double frame_rate = 30;    ///< of the clip, Hz; 0 keeps the source's
  UpAxis up = UpAxis::kY;    ///< of the source's world
  bool find_ground = true;   ///< false: the source's ground plane is kept where it is
  bool level_ground = true;  ///< take out the small tilt of a capture volume where feet show it
  double forearm_twist_share = 0.5;  ///< of the hand's roll that the elbow joint takes, 0..1: all
                                     ///< of it at the wrist wrings the skin there
};

struct RetargetReport {
  double scale = 1;              ///< lengths of the clip per length of the source (leg to leg)
  double ground_offset_m = 0;    ///< added to all heights so that feet stand on z = 0
  double ground_slope = 0;       ///< rise per meter that was taken out
  bool same_skeleton = false;    ///< the source rests like SMPL-X: its rotations are copied
  int repaired_hand_frames = 0;  ///< frames in which a source wrist was bent as no wrist bends
  /// Knees, ankles, elbows and wrists from their hip or shoulder, against the source's with each
  /// bone taken at the body's length: how far directions are given up (legs: for the ankle's
  /// place).
  double mean_joint_error_mm = 0;
  double max_joint_error_mm = 0;
  double mean_wrist_error_mm = 0;
  double max_wrist_error_mm = 0;
  /// Ankles from the middle of the hips against the source's, scaled as a whole.
  double mean_ankle_error_mm = 0;
  double max_ankle_error_mm = 0;
  /// The joint farthest from its place, mean over frames. A source of SMPL-X's own bones: any
  /// joint, scaled as a whole from the middle of the hips. Others start collarbones and spines
  /// elsewhere: elbows and wrists from the shoulder, each bone at the body's length, and ankles.
  int worst_place_joint = 0;
  double worst_place_mm = 0;
  /// The lines of the hips, of the shoulders, and from the middle of those to the middle of these
  /// against the source's: the worst, mean over frames.
  double trunk_error_rad = 0;
  /// Left and right hand's direction, from the wrist to the knuckles, against the source's: its
  /// knuckles, else what hangs on its hand, else its forearm turned as the hand's joint turns.
  std::array<double, 2> hand_error_rad{0, 0};
  /// Mean horizontal speed of the lowest point of the soles while within 3 cm of the ground, m/s.
  double foot_skate = 0;
  /// Height of that point, meters: mean while within 3 cm, and lowest of all frames.
  double mean_sole_height_m = 0;
  double min_sole_height_m = 0;
};

/// Brings a motion onto the SMPL-X skeleton. Bone directions are the source's; the roll of thighs
/// and upper arms follows the source's rotations, set so that knees and elbows bend about the
/// hinges of SMPL-X; hands follow their knuckles, feet stand flat where the source's do. The path
/// of the hips and the ankles is scaled by leg length. World z-up, ground z = 0; a source that
/// faces +z (y up) then faces -y.
///
/// Any local frames and any rest pose will do where motion and geometry show how the parts lie; a
/// source that rests like SMPL-X is copied rotation by rotation. The motion's prop becomes the
/// clip's object: its path is scaled as the body's, its size is not. Throws Error when bones of the
/// source have no length or the frame rate is not positive.
Clip Retarget(const SourceMotion& motion, const SkeletonMap& map, const RetargetBody& body,
              const RetargetOptions& options = {}, RetargetReport* report = nullptr);

}  // namespace holdfast
