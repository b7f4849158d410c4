// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"

namespace holdfast {

/// Frames beyond this number are ignored to limit memory.
inline constexpr std::size_t kMaxLooseFrames = 500'000;

/// Representation of the rotations of an array.
enum class RotationForm { kAxisAngle, kMatrix, kQuaternion, kSixD, kCoefficients };
std::string_view Describe(RotationForm form);

/// One array of a motion file as found.
struct LooseArray {
  std::string key;
  std::string role;   ///< "trans", "body", "left hand", "object rotation", ...
  std::string shape;  ///< "(145, 63)"
  std::string type;   ///< "float32"
  RotationForm form = RotationForm::kAxisAngle;
  int frames = 0;
  std::size_t out_of_range = 0;     ///< numbers that are NaN, infinite or out of range
  int first_out_of_range = -1;      ///< frame of the first
  double orthonormality_off = 0.0;  ///< matrices: largest entry of R^T R - I
};

/// A motion with any names and representations, for inspection; includes what ReadClip rejects.
struct LooseMotion {
  std::vector<LooseArray> arrays;
  std::vector<std::string> problems;  ///< unreadable arrays, as text
  double frame_rate = 0.0;            ///< 0: not in the file
  int frames = 0;                     ///< the minimum over arrays that have frames
  bool lengths_differ = false;
  bool has_trans = false, has_root = false, has_body = false, has_hands = false;
  int num_joints = 0;           ///< of the body model that wrote it; 0: unknown
  Eigen::Matrix3Xd trans;       ///< (3 x T), as stored
  std::vector<JointPose> pose;  ///< T; missing joints are zero; NaN as zero
  bool has_object = false;
  Eigen::Matrix3Xd object_trans;                 ///< (3 x T), as stored
  std::vector<Eigen::Matrix3d> object_rotation;  ///< assuming column vectors
  std::vector<int> holding_hand;                 ///< bits; empty if missing
  std::map<std::string, std::string> texts;      ///< gender, surface_model_type, ...
  int num_betas = -1;                            ///< -1: none

  /// Whether it is MANO's: the root is the wrist, and there is no upright body.
  bool IsHandAlone() const {
    const auto type = texts.find("surface_model_type");
    return type != texts.end() && type->second == "mano";
  }
};

/// Reads everything readable. Only throws std::bad_alloc; problems are in the result.
LooseMotion ReadLooseMotion(const NpzReader& archive);

/// Converts a clip to a loose motion, without information on a file's arrays.
LooseMotion LooseMotionOf(const Clip& clip);

}  // namespace holdfast
