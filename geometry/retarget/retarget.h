// SPDX-License-Identifier: MIT
#pragma once

/// Motion retargeting between skeletons: from a SourceMotion on any named skeleton to a clip and
/// back, and parameter conversion between body models.

#include <array>
#include <string_view>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {

/// The target body of a retargeted motion.
struct RetargetBody {
  Eigen::Matrix3Xd rest_joints;  ///< (3 x 55) meters, rest pose (y up), as BodyModel::RestJoints
  double floor_y = 0;            ///< ground under the rest pose: lowest vertex, meters
  Eigen::Matrix<double, kHandDofs, 1> left_hand =
      Eigen::Matrix<double, kHandDofs, 1>::Zero();  ///< fingers if the source has none, radians
  Eigen::Matrix<double, kHandDofs, 1> right_hand = Eigen::Matrix<double, kHandDofs, 1>::Zero();
};

/// Returns a model's body of this shape, with its mean hands.
RetargetBody RetargetBodyOf(const BodyModel& model, const Eigen::VectorXd& betas = {});

/// The up axis of a motion's world.
enum class UpAxis { kX, kMinusX, kY, kMinusY, kZ, kMinusZ };

/// "z", "-y", ...
std::string_view UpAxisName(UpAxis up);

struct RetargetOptions {
  double frame_rate = 30;   ///< of the clip, Hz; 0 keeps the source's
  UpAxis up = UpAxis::kY;   ///< of the source's world
  bool find_ground = true;  ///< false: keep the source's ground plane
};

struct RetargetReport {
  double scale = 1;              ///< clip length per source length (leg to leg)
  double ground_offset_m = 0;    ///< added to all heights so that feet stand on z = 0
  double ground_slope = 0;       ///< removed slope, rise per meter
  bool same_skeleton = false;    ///< the source's rest pose is SMPL-X's: rotations are copied
  int repaired_hand_frames = 0;  ///< frames with an impossible source wrist bend
  /// Knees, ankles, elbows and wrists relative to their hip or shoulder, compared with the source's
  /// at the body's bone lengths: the error in direction (for legs caused by the ankle position).
  double mean_joint_error_mm = 0;
  double max_joint_error_mm = 0;
  double mean_wrist_error_mm = 0;
  double max_wrist_error_mm = 0;
  /// Ankles relative to the middle of the hips, compared with the uniformly scaled source.
  double mean_ankle_error_mm = 0;
  double max_ankle_error_mm = 0;
  /// The joint of largest mean position error over frames. For a source with SMPL-X's bones: any
  /// joint, relative to the middle of the hips, uniformly scaled. Otherwise, as collarbones and
  /// spines differ, elbows and wrists relative to the shoulder at the body's bone lengths, and
  /// ankles.
  int worst_place_joint = 0;
  double worst_place_mm = 0;
  /// Direction error of the hip line, the shoulder line, and the line between their midpoints: the
  /// worst of the three, mean over frames.
  double trunk_error_rad = 0;
  /// Direction error of left and right hand, from wrist to knuckles. The source direction is given
  /// by its knuckles, else the end site of its hand, else its forearm rotated by the hand's joint.
  std::array<double, 2> hand_error_rad{0, 0};
  /// Mean horizontal speed of the lowest point of the soles while within 3 cm of the ground, m/s.
  double foot_skate = 0;
  /// Height of that point, meters: mean while within 3 cm, and minimum over all frames.
  double mean_sole_height_m = 0;
  double min_sole_height_m = 0;
};

/// Retargets a motion to the SMPL-X skeleton. Bone directions are the source's. The roll of thighs
/// and upper arms follows the source's rotations, offset so that knees and elbows bend about
/// SMPL-X's hinges. Hands follow their knuckles; feet are flat where the source's are. The paths of
/// hips and ankles are scaled by leg length. World z-up, ground z = 0; a source that faces +z (y
/// up) then faces -y.
///
/// Any local frames and any rest pose are supported if motion and geometry determine the
/// orientation of the parts; for a source with SMPL-X's rest pose, rotations are copied. The
/// motion's prop becomes the clip's object; its path is scaled like the body's, its size is not.
/// Throws Error if bones of the source have no length or the frame rate is not positive.
Clip Retarget(const SourceMotion& motion, const SkeletonMap& map, const RetargetBody& body,
              const RetargetOptions& options = {}, RetargetReport* report = nullptr);

}  // namespace holdfast
