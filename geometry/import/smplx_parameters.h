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

/// The dict with the parameters in a value that packs them: the value itself, one person of a list,
/// or a dict below a name such as `smplx` or `params`. Nothing when there is none.
std::optional<Fields> FindParameters(const Fields& fields);

/// Whether these are parameters of a body, by the names of the smplx package or of codes around it:
/// global_orient, body_pose (smplx_root_pose, smplx_body_pose; root_orient, pose_body; ...), or
/// `fullpose` with `transl`.
bool LooksLikeParameters(const Fields& fields);

/// Frames per second, under any of the names in use, in `fields` or in a dict below (MoSh++ keeps
/// it in stageii_debug_details); nothing when there is none. Throws Error for a rate that is not
/// positive.
std::optional<double> FrameRateOf(const Fields& fields);
/// The clip's frame rate, its frames being there: the file's, else the one that the options have,
/// else the one that mocap_time_length gives, else `assumed`, with a warning.
void SettleFrameRate(const Fields& fields, const ParameterOptions& options, double assumed,
                     ImportedClip& imported);
/// Whether a name is one of a frame rate's.
bool IsFrameRateName(std::string_view name);
/// The value of one of the names, in `fields` or in a dict at most `depth` levels below.
std::optional<DataValue> FindBelow(const Fields& fields, std::span<const std::string_view> names,
                                   int depth);
/// The smplx package's flag, where a file keeps it (Holdfast's do).
std::optional<bool> FlatHandMeanOf(const Fields& fields);

/// Parameters of SMPL-X as fitting codes write them, collected file by file (or frame by frame)
/// into one clip. Rotations as axis-angle or matrices, in the shapes that ReadRotations takes;
/// hands as angles, matrices or PCA coefficients (FingerAngles); a body of 23 joints (SMPL) loses
/// its last two. The latent of VPoser (32 numbers) is refused: it means nothing without that
/// network. betas of several frames are averaged. Expression and cameras are dropped.
class ParameterCollector {
 public:
  /// `options` must outlive this.
  explicit ParameterCollector(const ParameterOptions& options);

  /// Puts the frames of `fields` behind those that are there. Throws Error naming file and field.
  void Add(const Fields& fields);

  /// The clip in the file's world. `known_flat` is the format's flat_hand_mean, where it is known;
  /// otherwise the fingers tell, with a note.
  ImportedClip Collect(std::optional<bool> known_flat = {});

 private:
  Eigen::MatrixXd ReadBody(const DataValue& value, Eigen::Index frames);
  void AddHands(const Fields& fields, std::vector<JointPose>& pose);
  void AddBetas(const Fields& fields);
  void AddTrans(const Fields& fields, Eigen::Index frames);
  void ListDropped(const Fields& packed, const Fields& fields);
  void DecideFlat(std::optional<bool> known_flat);
  void DecideBetas();

  const ParameterOptions& options_;
  ImportedClip imported_;
  FingerAngles fingers_;
  std::vector<Eigen::MatrixXd> trans_;
  std::vector<Eigen::VectorXd> betas_;
  int frames_without_trans_ = 0;
  bool has_fingers_ = false, is_smpl_ = false;
};

/// All of one file, and the object in a file beside it (AddObjectBeside), in a clip's world:
/// `known_up` is the format's axis, where it is known; otherwise the posture tells, with a note,
/// and the floor is where the feet are.
ImportedClip ImportParameters(const Fields& fields, const std::filesystem::path& path,
                              const ParameterOptions& options, std::optional<WorldUp> known_up = {},
                              std::optional<bool> known_flat = {});

}  // namespace holdfast
