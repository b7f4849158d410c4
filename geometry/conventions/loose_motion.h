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

/// More frames than this are not looked at: they would fill the memory.
inline constexpr std::size_t kMaxLooseFrames = 500'000;

/// How the rotations of an array are written.
enum class RotationForm { kAxisAngle, kMatrix, kQuaternion, kSixD, kCoefficients };
std::string_view Describe(RotationForm form);

/// One array of a motion file as it was found.
struct LooseArray {
  std::string key;
  std::string role;   ///< "trans", "body", "left hand", "object rotation", ...
  std::string shape;  ///< "(145, 63)"
  std::string type;   ///< "float32"
  RotationForm form = RotationForm::kAxisAngle;
  int frames = 0;
  std::size_t out_of_range = 0;     ///< numbers that are NaN, infinite or beyond all ranges
  int first_out_of_range = -1;      ///< frame of the first
  double orthonormality_off = 0.0;  ///< matrices: largest entry of R^T R - I
};

/// Motion in whatever names and forms were found, for looking at: what ReadClip refuses too.
struct LooseMotion {
  std::vector<LooseArray> arrays;
  std::vector<std::string> problems;  ///< arrays that could not be read, in words
  double frame_rate = 0.0;            ///< 0: the file does not tell
  int frames = 0;                     ///< shortest of the arrays that have frames
  bool lengths_differ = false;
  bool has_trans = false, has_root = false, has_body = false, has_hands = false;
  int num_joints = 0;           ///< of the body model that wrote it; 0: not to be told
  Eigen::Matrix3Xd trans;       ///< (3 x T), as stored
  std::vector<JointPose> pose;  ///< T, joints that are missing zero; NaN as zero
  bool has_object = false;
  Eigen::Matrix3Xd object_trans;                 ///< (3 x T), as stored
  std::vector<Eigen::Matrix3d> object_rotation;  ///< as if for column vectors
  std::vector<int> holding_hand;                 ///< bits, empty if not there
  std::map<std::string, std::string> texts;      ///< gender, surface_model_type, ...
  int num_betas = -1;                            ///< -1: none

  /// MANO's: the root is the wrist, and there is no body to be upright.
  bool IsHandAlone() const {
    const auto type = texts.find("surface_model_type");
    return type != texts.end() && type->second == "mano";
  }
};

/// Reads what can be read. Throws nothing but std::bad_alloc; problems are in the result.
LooseMotion ReadLooseMotion(const NpzReader& archive);

/// A clip as such a motion, without what was found of a file's arrays.
LooseMotion LooseMotionOf(const Clip& clip);

}  // namespace holdfast
