// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <vector>

#include "geometry/import/fields.h"

namespace holdfast {

/// Whether these are parameters of a MANO hand, with or without its object, in the names of HO-3D,
/// DexYCB, OakInk, TACO or EasyMocap (GigaHands): one frame, all frames, or a dict with one dict
/// for each frame ("00001", ...).
bool LooksLikeHandSet(const Fields& fields);
/// Imports such a file, or the files of one sequence in their order (ClipOfHand).
ImportedClip ImportHandSet(const Fields& fields, const std::filesystem::path& path,
                           const ParameterOptions& options);
ImportedClip ImportHandFrames(const std::vector<std::filesystem::path>& frames,
                              const ParameterOptions& options);

/// Whether this is an array of MANO parameters without names: (T, 48) angles, (T, 51) or (2, T, 51)
/// coefficients and a translation of one hand, or of the right and the left hand (HO-Cap).
bool LooksLikeHandArray(const DataValue& value);
ImportedClip ImportHandArray(const DataValue& value, const std::filesystem::path& path,
                             const ParameterOptions& options);

/// The frames of a folder of H2O (Kwon et al. 2021): hand_pose_mano/NNNNNN.txt, in their order, of
/// that folder or of the one above; none for any other folder.
std::vector<std::filesystem::path> FindH2oFrames(const std::filesystem::path& folder);
/// Imports them, with obj_pose_rt and cam_pose beside them. Throws Error for other numbers.
ImportedClip ImportH2o(const std::vector<std::filesystem::path>& frames,
                       const ParameterOptions& options);

/// Whether this is mano_fits_N.json of ContactPose (Brahmbhatt et al. 2020): a left and a right
/// hand.
bool LooksLikeContactPose(const DataValue& root);
/// Imports the grasp as a clip of one frame, in the frame of the object.
ImportedClip ImportContactPose(const DataValue& root, const std::filesystem::path& path,
                               const ParameterOptions& options);

/// Whether this is an annotation of OakInk2 (Zhan et al. 2024), anno_preview/*.pkl.
bool LooksLikeOakInk2(const Fields& fields);
/// Imports its body with both hands, or a hand alone (--hands rhand, lhand), with the object that
/// ChooseObject takes. y-up, 120 Hz.
ImportedClip ImportOakInk2(const Fields& fields, const std::filesystem::path& path,
                           const ParameterOptions& options);

/// Whether this is a list of frames with `hand_poses` of HOT3D ("0": left, "1": right).
bool LooksLikeHot3d(const DataValue& root);
/// Imports mano_hand_pose_trajectory.jsonl of HOT3D, and of dynamic_objects.csv, beside it or in
/// ../ground_truth, the object that is nearest to the hand. Throws Error for UmeTrack's angles.
ImportedClip ImportHot3d(const DataValue& root, const std::filesystem::path& path,
                         const ParameterOptions& options);

}  // namespace holdfast
