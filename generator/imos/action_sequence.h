// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/config.h"
#include "generator/wandr/pose.h"
#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast::imos {

/// Which moments of a clip are its key frames.
enum class KeyFrameRule {
  /// 15 moments evenly spread from the first frame to the last, between frames where need be.
  kWhole,
  /// As published: a, a + s, ..., a + 14 s, where a and b are the first and last frame with any
  /// contact with the object and s = floor((b - a) / 20): about 70 % of the contact.
  kPaper,
};

/// First and last frame in which anything touches the object: by the clip's contact labels where it
/// has them, else by `holding_hand`. Nothing when nothing does, or neither is there.
std::optional<std::pair<int, int>> ContactInterval(const Clip& clip);

/// Why the clip has no key frames by this rule: it is shorter than 15 frames; by the paper's rule,
/// nothing touches the object, or for less than 20 frames. Nothing where it has them.
std::optional<std::string> LackOfKeyFrames(const Clip& clip, KeyFrameRule rule);

/// The clip's 15 key frames as a clip of their own; its frame rate is theirs. Throws Error where
/// it has none.
Clip KeyFramesOf(const Clip& clip, KeyFrameRule rule);

inline constexpr int kPoseNumbers = 6 * kNumJoints;  ///< 55 rotations, six numbers each

/// Six numbers of each rotation, per key frame: rows12(R_j) = (R00 R01 R02 R10 R11 R12) from row
/// 6j.
using PoseColumns = Eigen::Matrix<double, kPoseNumbers, Eigen::Dynamic>;
using RotationColumns = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// The frame in which networks see a sequence: the root translation of key frame 0 is zero, and the
/// body then faces -y; z stays up. With p0 the pelvis of key frame 0 in the world and J_0 the rest
/// pelvis, x_canonical = turn (x_world - p0) + J_0. (GRAB's subjects face -y as they are; the
/// published code only subtracts the translation.)
struct CanonicalFrame {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();     ///< about z: canonical_from_world
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();       ///< p0, world, meters
  Eigen::Vector3d rest_pelvis = Eigen::Vector3d::Zero();  ///< J_0

  Eigen::Vector3d PointFromWorld(const Eigen::Vector3d& x) const {
    return turn * (x - pelvis) + rest_pelvis;
  }
  Eigen::Vector3d PointToWorld(const Eigen::Vector3d& x) const {
    return turn.transpose() * (x - rest_pelvis) + pelvis;
  }
  /// Of SMPL-X `transl`, which is where the pelvis is less J_0.
  Eigen::Vector3d TranslFromWorld(const Eigen::Vector3d& transl) const {
    return turn * (transl + rest_pelvis - pelvis);
  }
  Eigen::Vector3d TranslToWorld(const Eigen::Vector3d& transl) const {
    return turn.transpose() * transl + pelvis - rest_pelvis;
  }
  /// Of the root and of objects.
  Eigen::Matrix3d RotationFromWorld(const Eigen::Matrix3d& R) const { return turn * R; }
  Eigen::Matrix3d RotationToWorld(const Eigen::Matrix3d& R) const { return turn.transpose() * R; }
};

/// Of a body with this root rotation and translation. Without `turn_heading` only the translation
/// is taken away, as published.
CanonicalFrame CanonicalFrameOf(const Eigen::Matrix3d& root, const Eigen::Vector3d& transl,
                                const Eigen::Vector3d& rest_pelvis, bool turn_heading = true);

/// What moves the object from one key frame to the next.
enum class Carrier : std::uint8_t { kNothing, kRightWrist, kLeftWrist };

/// Key frames of somebody who does something with an object: what networks learn from and begin
/// with. All in the canonical frame, meters; x = R x_object + T for columns, as everywhere here.
struct ActionSequence {
  std::string name;    ///< "mug_drink_1"
  std::string source;  ///< file
  std::string subject;
  std::string gender;
  int action = 0;  ///< of the vocabulary
  int object = 0;  ///< of the vocabulary
  bool mirrored = false;
  double seconds_per_key_frame = 0.0;
  Eigen::Vector<double, kNumBetas> betas = Eigen::Vector<double, kNumBetas>::Zero();
  Eigen::Matrix<double, 3, kNumJoints> rest_joints;  ///< of the subject

  PoseColumns pose;                 ///< (330 x T)
  Eigen::Matrix3Xd transl;          ///< (3 x T) SMPL-X translation of the root
  Eigen::Matrix3Xd object_transl;   ///< (3 x T)
  RotationColumns object_rotation;  ///< (6 x T) rows12(R)
  std::vector<std::uint8_t> hands;  ///< T: who holds, bits as Clip::holding_hand; 0 where not known
  /// T: how the object came here from the key frame before, the first as the second. Of those that
  /// hold (of all where that is not known) the one that explains the object's motion best.
  std::vector<Carrier> carriers;
  Eigen::MatrixXd joints;    ///< (66 x T) positions of joints 0..21, three rows each
  CanonicalFrame canonical;  ///< the way back into the clip's world

  int NumKeyFrames() const { return static_cast<int>(pose.cols()); }
  Eigen::Matrix3d Rotation(int joint, int key_frame) const;
  Eigen::Matrix3d ObjectRotation(int key_frame) const;
  /// Joints 0..21 and the translation of a key frame.
  wandr::Pose<double> BodyPose(int key_frame) const;
  /// object_rotation as GRAB means it, for row vectors: rows12(R^T). The published weights take it.
  RotationColumns ObjectRotationForRows() const;
};

struct SequenceOptions {
  KeyFrameRule rule = KeyFrameRule::kWhole;
  bool turn_heading = true;
};

/// The key frames of a clip with an object, an action and an object's name of the vocabulary;
/// `rest_joints` (3 x 55) are the subject's. Throws Error for a clip that lacks one of them, whose
/// action or object is not in the vocabulary, or that has no such key frames (KeyFramesOf).
ActionSequence SequenceFromClip(const Clip& clip,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& rest_joints,
                                const SequenceOptions& options = {});
/// Of a clip whose shape is `body`'s: the clip's own surface, or its betas where they are the
/// model's.
ActionSequence SequenceFromClip(const Clip& clip, const std::shared_ptr<const BodyModel>& body,
                                const SequenceOptions& options = {});

/// The sequence seen in a mirror at x = 0, sides exchanged: joints, hands, the subject's bones. The
/// object is mirrored in its own frame at x = 0 too, R' = M R M with M = diag(-1, 1, 1): its mesh,
/// which nothing here looks at, is the mirror image of what it was.
ActionSequence Mirrored(const ActionSequence& sequence);

/// Pose of the object that `carrier` carries rigidly from the body `from` to the body `to` (a
/// transform of columns, x = R x_object + T).
struct ObjectPose {
  Eigen::Matrix3d R;
  Eigen::Vector3d T;
};
ObjectPose Carried(const ObjectPose& object, Carrier carrier,
                   const wandr::BodyKinematics<double>& from,
                   const wandr::BodyKinematics<double>& to);

}  // namespace holdfast::imos
