// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/import/import_file.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/options.h"
#include "geometry/retarget/convert_parameters.h"

namespace holdfast {

/// How closely the arms of a body follow a hand.
struct HandOntoBodyReport {
  double max_missing_mm = 0.0;  ///< distance of the wrists
  int frames_out_of_reach = 0;  ///< farther than a millimeter
};

/// Transfers the motion of a single hand (MANO) to a body. In each frame the body's wrist moves to
/// the hand's root in the world, using only the arm joints (MoveWrist), and the fingers are copied.
/// The rest of the body is unchanged. `hand` must be a clip of `hand_model` with `hand_betas`;
/// `body` is modified in place. Throws Error if the clips differ in length.
HandOntoBodyReport PutHandOntoBody(const Clip& hand, const BodyModel& hand_model,
                                   const Eigen::VectorXd& hand_betas, const BodyModel& body_model,
                                   const Eigen::VectorXd& body_betas, Clip& body);

/// A clip in the parameters of another model.
struct Conversion : ConvertedClip {
  std::optional<HandOntoBodyReport> arms;  ///< for a single hand that was transferred to a body
};

/// Converts a single hand to a body, which ConvertClip does not support: returns `onto`, the motion
/// of `person`, with wrist and fingers taken from `hand` (a clip of `from`; see PutHandOntoBody),
/// and its object and holding_hand. Throws Error as PutHandOntoBody does.
Conversion ConvertOntoBody(const Clip& hand, const ClipBody& from, Clip onto,
                           const ClipBody& person);

/// How finger angles are given: complete (flat_hand_mean), or relative to the model's mean hand.
enum class HandConvention { kAuto, kComplete, kRelative };

struct ConvertOptions {
  HandConvention from_hands = HandConvention::kAuto;  ///< of the clip; kAuto: by its format
  int betas = kConvertedBetas;
};
OptionTable OptionsOf(ConvertOptions& options);

/// Reads files of other programs without changing their world frame.
ImportFileOptions ImportToConvert(const ConvertOptions& options);

/// Adds the mean hand of its model to a clip that was not imported, if its angles are relative.
void CompleteHands(const ConvertOptions& options, const BodyModel& from, Clip& clip);

struct ParameterFileOptions {
  std::string layout = "auto";  ///< or "amass", "smplx", "smplh", "mano"
  HandConvention to_hands = HandConvention::kComplete;
};
OptionTable OptionsOf(ParameterFileOptions& options);

/// Layout of a parameter file of `model` with this name. Throws Error for a layout of another
/// model.
ParameterLayout LayoutOf(const BodyModel& model, const ParameterFileOptions& options,
                         const std::filesystem::path& path);

/// Writes a clip of `model` as a parameter file (.npz, .json). Throws Error for a layout of another
/// model.
void WriteParameters(Clip clip, const BodyModel& model, const ParameterFileOptions& options,
                     const std::filesystem::path& path);

/// {"residual": {"joints": {name: {mean_mm, max_mm}}, mean_mm, max_mm, and of vertices if both
/// models have the same}, "arm": {frames_out_of_reach, max_missing_mm} after ConvertOntoBody,
/// "not_carried_over": [text, ...]}.
nlohmann::json ConversionJson(const Conversion& conversion);

}  // namespace holdfast
