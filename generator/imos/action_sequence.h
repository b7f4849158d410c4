// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/config.h"
#include "generator/wandr/pose.h"
#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast::imos {

/// Rule that selects the key frames of a clip.
enum class KeyFrameRule {
  /// 15 times evenly spaced from the first frame to the last, interpolated if needed.
  kWhole,
  /// As published: a, a + s, ..., a + 14 s, where a and b are the first and last frame with any
  /// contact with the object, and s = floor((b - a) / 20). Covers about 70 % of the contact.
  kPaper,
};

/// Returns why the clip has no key frames by this rule: it has fewer than 15 frames; by the paper's
/// rule, there is no contact, or b - a < 20. Returns nullopt if it has key frames.
std::optional<std::string> LackOfKeyFrames(const Clip& clip, KeyFrameRule rule);

/// Returns the clip's 15 key frames as a clip; its frame rate is that of the key frames. Throws
/// Error if there are none.
Clip KeyFramesOf(const Clip& clip, KeyFrameRule rule);

inline constexpr int kPoseNumbers = 6 * kNumJoints;  ///< 55 rotations, six numbers each

/// Six numbers of each rotation per key frame: rows12(R_j) = (R00 R01 R02 R10 R11 R12), from row
/// 6j.
using PoseColumns = Eigen::Matrix<double, kPoseNumbers, Eigen::Dynamic>;
using RotationColumns = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Input frame of the networks: the root translation of key frame 0 is zero and the body faces -y
/// there; z is up. With p0 the world position of the pelvis in key frame 0 and J_0 the rest pelvis,
/// x_canonical = turn (x_world - p0) + J_0. (GRAB's subjects already face -y; the published code
/// only subtracts the translation.)
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
  /// For SMPL-X `transl`, which is the pelvis position minus J_0.
  Eigen::Vector3d TranslFromWorld(const Eigen::Vector3d& transl) const {
    return turn * (transl + rest_pelvis - pelvis);
  }
  Eigen::Vector3d TranslToWorld(const Eigen::Vector3d& transl) const {
    return turn.transpose() * transl + pelvis - rest_pelvis;
  }
  /// For rotations of the root and of objects.
  Eigen::Matrix3d RotationFromWorld(const Eigen::Matrix3d& R) const { return turn * R; }
  Eigen::Matrix3d RotationToWorld(const Eigen::Matrix3d& R) const { return turn.transpose() * R; }
};

/// Returns the canonical frame for a root rotation and translation.
CanonicalFrame CanonicalFrameOf(const Eigen::Matrix3d& root, const Eigen::Vector3d& transl,
                                const Eigen::Vector3d& rest_pelvis);

/// Body part that moves the object between two key frames.
enum class Carrier : std::uint8_t { kNothing, kRightWrist, kLeftWrist };

/// Key frames of an action with an object, for training and as start of a synthesis. All in the
/// canonical frame, meters; x = R x_object + T for column vectors, as everywhere here.
struct ActionSequence {
  std::string name;    ///< "mug_drink_1"
  std::string source;  ///< file
  std::string subject;
  std::string gender;
  int action = 0;  ///< index in the vocabulary
  int object = 0;  ///< index in the vocabulary
  bool mirrored = false;
  double seconds_per_key_frame = 0.0;
  Eigen::Vector<double, kNumBetas> betas = Eigen::Vector<double, kNumBetas>::Zero();
  Eigen::Matrix<double, 3, kNumJoints> rest_joints;  ///< of the subject

  PoseColumns pose;                 ///< (330 x T)
  Eigen::Matrix3Xd transl;          ///< (3 x T) SMPL-X translation of the root
  Eigen::Matrix3Xd object_transl;   ///< (3 x T)
  RotationColumns object_rotation;  ///< (6 x T) rows12(R)
  std::vector<std::uint8_t> hands;  ///< T: holding hands, bits as Clip::holding_hand; 0: unknown
  /// T: carrier of the object from the previous key frame; the first entry equals the second. Among
  /// the holding hands (all, if unknown), the carrier that best explains the object motion.
  std::vector<Carrier> carriers;
  Eigen::MatrixXd joints;    ///< (66 x T) positions of joints 0..21, three rows each
  CanonicalFrame canonical;  ///< maps back to the world of the clip

  int NumKeyFrames() const { return static_cast<int>(pose.cols()); }
  Eigen::Matrix3d Rotation(int joint, int key_frame) const;
  Eigen::Matrix3d ObjectRotation(int key_frame) const;
  /// Joints 0..21 and the translation of a key frame.
  wandr::Pose<double> BodyPose(int key_frame) const;
};

/// Extracts the key frames of a clip whose action and object are in the vocabulary. `rest_joints`
/// (3 x 55) are those of the subject. Throws Error for a clip without object, action or object
/// name, with an unknown action or object, or without key frames (KeyFramesOf).
ActionSequence SequenceFromClip(const Clip& clip,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& rest_joints,
                                KeyFrameRule rule = KeyFrameRule::kWhole);
/// Same, with the shape of the subject on `body`: the clip's own surface, or its betas if they are
/// for this model.
ActionSequence SequenceFromClip(const Clip& clip, const std::shared_ptr<const BodyModel>& body,
                                KeyFrameRule rule = KeyFrameRule::kWhole);

/// Mirrors the sequence at x = 0 and swaps the sides of joints, hands and the subject's bones. The
/// object is also mirrored at x = 0 in its own frame, R' = M R M with M = diag(-1, 1, 1), so its
/// mesh, which is not used here, is the mirror image.
ActionSequence Mirrored(const ActionSequence& sequence);

/// Pose of the object carried rigidly by `carrier` from body pose `from` to body pose `to` (a
/// transform of column vectors, x = R x_object + T).
struct ObjectPose {
  Eigen::Matrix3d R;
  Eigen::Vector3d T;
};
ObjectPose Carried(const ObjectPose& object, Carrier carrier,
                   const wandr::BodyKinematics<double>& from,
                   const wandr::BodyKinematics<double>& to);

}  // namespace holdfast::imos
