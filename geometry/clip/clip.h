// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/skeleton.h"

/// Human motion in SMPL-X parameters, with or without an object: reading and writing `.npz` files,
/// resampling, change of body model, and preparation for display.

namespace holdfast {

inline constexpr std::uint8_t kHoldsRight = 1;  ///< bits of `holding_hand`
inline constexpr std::uint8_t kHoldsLeft = 2;

/// Bit of a hand in Clip::holding_hand.
inline constexpr std::uint8_t HoldingBit(Side side) {
  return side == Side::kRight ? kHoldsRight : kHoldsLeft;
}

class NpzReader;
struct TriangleMesh;

/// Pose of an object over a clip: x_world = R x_object + T, column vectors.
struct ObjectTrack {
  Eigen::Matrix3Xd trans;   ///< (3 x T) meters
  Eigen::Matrix3Xd orient;  ///< (3 x T) axis-angle, radians
  std::string name;
  std::string mesh;  ///< file name of the mesh, relative to the clip
  /// The mesh itself, meters, if the creator of the track provides it; not stored in clip files.
  std::shared_ptr<const TriangleMesh> surface = nullptr;

  /// Returns world_from_object in a frame.
  Eigen::Isometry3d Pose(Eigen::Index frame) const;
  /// Sets the pose. The axis-angle is nearest to the previous; in frame 0 to the old one.
  void SetPose(Eigen::Index frame, const Eigen::Isometry3d& world_from_object);
};

/// Contact labels of a capture: one column per frame. 0 is no contact. On the object, a label is
/// the SMPL-X joint of the touching part + 1 (GRAB: 21 left hand, 22 right hand, 26-40 left and
/// 41-55 right fingers); on the body, any number but 0.
struct ContactLabels {
  using Matrix = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix object;  ///< (V_object x T), of the capture's mesh; empty if there is none
  Matrix body;    ///< (V_body x T), of the capture's body model; empty if there is none
};

/// A human motion in SMPL-X parameters, optionally with an object. World: z up, ground z = 0,
/// meters. The file format is AMASS's SMPL-X layout (`.npz`) with additional arrays.
struct Clip {
  double frame_rate = 30.0;     ///< `mocap_frame_rate`, Hz
  Eigen::Matrix3Xd trans;       ///< (3 x T) root translation: joint positions are G_j + trans
  std::vector<JointPose> pose;  ///< T poses: root_orient, pose_body, jaw, eyes, hands
  Eigen::VectorXd betas;        ///< shape coefficients, any number
  std::string gender = "neutral";
  std::string surface_model_type = "smplx";
  /// Body model of the betas, as in BodyModel::Name(). Empty in files of other programs, which
  /// refer to SMPL-X of `gender`.
  std::string body_model;
  std::optional<ObjectTrack> object;
  /// Support surface of the object, with a pose track like the object's; its mesh is not needed.
  std::optional<ObjectTrack> table;
  /// The subject's own rest surface (3 x V) in the body model's numbering, meters; empty: use the
  /// shape given by `betas`. If present, it defines the shape, and betas are only informative.
  Eigen::Matrix3Xd v_template;
  std::optional<ContactLabels> contact;
  std::string subject;                     ///< "s1"; empty if unknown
  std::string action;                      ///< action: "drink"; empty if unknown
  std::vector<std::uint8_t> holding_hand;  ///< per frame, empty or T long: 1 right, 2 left, 3 both

  int NumFrames() const { return static_cast<int>(pose.size()); }
};

/// Reads a clip. `poses (T,165)` (AMASS's concatenated form) is accepted in place of the parts.
/// Throws Error, naming file and field, for missing fields, wrong shapes, unequal lengths, values
/// that are NaN, infinite or out of range (geometry/options.h), and no frames.
Clip ReadClip(const std::filesystem::path& path);
Clip ReadClip(const NpzReader& archive);

/// Throws Error (`where`, with field and frame) for the first number that is NaN or outside the
/// ranges of geometry/options.h.
void RequireInRange(const Clip& clip, std::string_view where);

/// Writes a clip (float64), atomically. The bytes are deterministic.
void WriteClip(const Clip& clip, const std::filesystem::path& path);

/// Returns frames [begin, end) as a clip.
Clip Slice(const Clip& clip, int begin, int end);

}  // namespace holdfast
