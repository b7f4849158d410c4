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

/// Human motion in SMPL-X parameters, with or without an object: `.npz` files or frames come in;
/// clips resampled, on another body model or ready to be shown come out.

namespace holdfast {

inline constexpr std::uint8_t kHoldsRight = 1;  ///< bits of `holding_hand`
inline constexpr std::uint8_t kHoldsLeft = 2;

class NpzReader;
struct TriangleMesh;

/// The object's way through a clip: x_world = R x_object + T, column vectors.
struct ObjectTrack {
  Eigen::Matrix3Xd trans;   ///< (3 x T) meters
  Eigen::Matrix3Xd orient;  ///< (3 x T) axis-angle, radians
  std::string name;
  std::string mesh;  ///< file name of the mesh, relative to the clip
  /// The mesh itself, meters, where whoever made the track keeps it; no file of a clip has it.
  std::shared_ptr<const TriangleMesh> surface = nullptr;

  /// world_from_object in a frame.
  Eigen::Isometry3d Pose(Eigen::Index frame) const;
  /// Its axis-angle is the one nearest to the frame before's; in frame 0 to what stands there.
  void SetPose(Eigen::Index frame, const Eigen::Isometry3d& world_from_object);
};

/// Who touches whom, as a capture labeled it: one column per frame. 0 is no contact; on the object
/// the SMPL-X joint of the touching part + 1 (GRAB: 21 left hand, 22 right hand, 26-40 left and
/// 41-55 right fingers), on the body any number but 0.
struct ContactLabels {
  using Matrix = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix object;  ///< (V_object x T), of the capture's mesh; empty when there is none
  Matrix body;    ///< (V_body x T), of the capture's body model; empty when there is none
};

/// A human motion in SMPL-X parameters, optionally with an object. World: z up, ground z = 0,
/// meters. The file is AMASS's SMPL-X layout (`.npz`); what Holdfast adds are extra arrays.
struct Clip {
  double frame_rate = 30.0;     ///< `mocap_frame_rate`, Hz
  Eigen::Matrix3Xd trans;       ///< (3 x T) root translation: joint positions are G_j + trans
  std::vector<JointPose> pose;  ///< T poses: root_orient, pose_body, jaw, eyes, hands
  Eigen::VectorXd betas;        ///< shape coefficients, any number
  std::string gender = "neutral";
  std::string surface_model_type = "smplx";
  /// Body model whose betas these are, as in BodyModel::Name(); empty in files of other programs,
  /// where SMPL-X of `gender` is meant.
  std::string body_model;
  std::optional<ObjectTrack> object;
  /// What the object rests on, moving as the object does; no mesh of it is needed.
  std::optional<ObjectTrack> table;
  /// The subject's own rest surface (3 x V) in the body model's numbering, meters; empty: the shape
  /// that `betas` give. Where it is there it is the shape, and betas only describe it.
  Eigen::Matrix3Xd v_template;
  std::optional<ContactLabels> contact;
  std::string subject;                     ///< "s1"; empty when not known
  std::string action;                      ///< what is being done: "drink"; empty when not known
  std::vector<std::uint8_t> holding_hand;  ///< per frame, empty or T long: 1 right, 2 left, 3 both

  int NumFrames() const { return static_cast<int>(pose.size()); }
};

/// Reads a clip. `poses (T,165)` (AMASS's concatenated form) is accepted in place of the parts.
/// Throws Error naming file and field: missing, wrong shape, unequal lengths, NaN or infinite
/// values or such beyond all ranges (geometry/value_ranges.h), no frames.
Clip ReadClip(const std::filesystem::path& path);
Clip ReadClip(const NpzReader& archive);

/// Throws Error (`where`, with the field and the frame) for the first number that is outside the
/// ranges of geometry/value_ranges.h or no number.
void RequireInRange(const Clip& clip, std::string_view where);

/// Writes a clip (float64), atomically. The same clip gives the same bytes.
void WriteClip(const Clip& clip, const std::filesystem::path& path);

/// Frames [begin, end) as a clip of their own.
Clip Slice(const Clip& clip, int begin, int end);

}  // namespace holdfast
