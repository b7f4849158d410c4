// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "geometry/import/fields.h"
#include "geometry/import/mano_parameters.h"

namespace holdfast {

/// Whether these are parameters of a body, by the names of the smplx package or related codes:
/// global_orient, body_pose (smplx_root_pose, smplx_body_pose; root_orient, pose_body; ...), or
/// `fullpose` with `transl`.
bool LooksLikeParameters(const Fields& fields);

/// Sets the clip's frame rate once its frames are read: from the file, else the options, else
/// mocap_time_length, else `assumed`, with a warning. Throws Error for a rate that is not positive.
void SettleFrameRate(const Fields& fields, const ParameterOptions& options, double assumed,
                     ImportedClip& imported);
/// Whether a name is one of the names of a frame rate.
bool IsFrameRateName(std::string_view name);
/// Value of the first of `names`, in `fields` or in a dict at most `depth` levels below.
std::optional<DataValue> FindBelow(const Fields& fields, std::span<const std::string_view> names,
                                   int depth);
/// The smplx package's flag, if the file has it (Holdfast's files do).
std::optional<bool> FlatHandMeanOf(const Fields& fields);

/// Collects SMPL-X parameters as fitting codes write them, file by file (or frame by frame), into
/// one clip. Rotations are axis-angle or matrices, in shapes that ReadRotations accepts; hands are
/// angles, matrices or PCA coefficients (FingerAngles). A body of 23 joints (SMPL) loses its last
/// two. VPoser latents (32 numbers) are rejected: they have no meaning without the network. betas
/// of several frames are averaged. Expression and cameras are dropped.
class ParameterCollector {
 public:
  /// `options` must outlive this.
  explicit ParameterCollector(const ParameterOptions& options);

  /// Appends the frames of `fields`. Throws Error naming file and field.
  void Add(const Fields& fields);

  /// Returns the clip in the file's world. `known_flat` is the format's flat_hand_mean, if known;
  /// otherwise it is judged from the fingers, with a note.
  ImportedClip Collect(std::optional<bool> known_flat = {});

 private:
  Eigen::MatrixXd ReadBody(const DataValue& value, Eigen::Index frames);
  void AddHands(const Fields& fields, std::vector<JointPose>& pose);
  void AddEasyMocap(const Fields& fields, std::vector<JointPose>& pose);
  void AddBetas(const Fields& fields);
  void AddTrans(const Fields& fields, Eigen::Index frames);
  void ListDropped(const Fields& packed, const Fields& fields);
  void DecideFlat(std::optional<bool> known_flat);
  void DecideBetas();

  const ParameterOptions& options_;
  ImportedClip imported_;
  FingerAngles fingers_;
  std::vector<Eigen::MatrixXd> trans_, betas_;  // of the parts
  int frames_without_trans_ = 0;
  bool has_fingers_ = false, is_smpl_ = false;
};

/// Imports one file and the object in a file next to it (AddObjectBeside), in a clip's world.
/// The posture decides which axis is up, with a note, and the floor is at the feet.
ImportedClip ImportParameters(const Fields& fields, const std::filesystem::path& path,
                              const ParameterOptions& options);

}  // namespace holdfast
