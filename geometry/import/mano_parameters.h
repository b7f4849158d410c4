// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"
#include "geometry/import/fields.h"
#include "geometry/io/container/data_value.h"

namespace holdfast {

/// What the parameters of a hand alone are called in a file.
struct HandFieldNames {
  std::string_view orient, pose;
  std::span<const std::string_view> trans, betas;  ///< the first that is there
};

/// A MANO hand as a clip of a hand alone: `orient` and `trans` its root, `pose` 15 joints or
/// coefficients. `flat`: whether these are complete, or differences from the mean hand. Without a
/// translation it is zero, with a warning. No world is settled. Throws Error naming the field.
ImportedClip ReadHandAlone(const Fields& fields, const HandFieldNames& names, Side side, bool flat,
                           const ParameterOptions& options);

/// Whether these are MANO's parameters in the smplx package's names: `global_orient`, `hand_pose`
/// and no body, in the file or in a dict below a name such as `pred_mano_params` (HaMeR).
bool LooksLikeMano(const Fields& fields);

/// Such parameters, rotations in every form that ReadRotations takes. The hand is the one that
/// `is_rhand` tells (Holdfast's files do; or `is_right`), else the one that the options ask for,
/// else a right one, with a note. Finger angles are as `flat_hand_mean` in the file tells, else on
/// top of the mean hand, the package's default. The object is taken from a file beside it
/// (AddObjectBeside).
ImportedClip ImportMano(const Fields& fields, const std::filesystem::path& path,
                        const ParameterOptions& options);

/// Principal components and mean of one hand, as SMPL-X and MANO files have them.
struct HandSpace {
  Eigen::MatrixXd components;  ///< (K x 45), one component a row
  Eigen::Matrix<double, kHandDofs, 1> mean;
};

/// What turns the numbers of a file into finger angles (the smplx package's terms):
///   angles = coefficients * components[0:n] + (flat_hand_mean ? 0 : mean)
/// and for numbers that are angles already, angles = numbers + (flat_hand_mean ? 0 : mean).
class FingerAngles {
 public:
  /// Reads hands_componentsl/r and hands_meanl/r (SMPL-X), or hands_components and hands_mean with
  /// the side by the file's name (MANO_LEFT, MANO_RIGHT), from each of `options.hand_models`.
  /// Throws Error for a file with neither.
  explicit FingerAngles(const ParameterOptions& options);

  /// Finger angles (45 x T) of an array of fingers: rotations in any form that ReadRotations takes,
  /// or n < 45 coefficients a frame; no mean added. `frames` as for ReadRotations. Throws Error
  /// when coefficients come without components.
  Eigen::MatrixXd Read(const DataValue& value, Side side, ImportedClip& imported,
                       Eigen::Index frames = 0);

  /// Whether anything was read that a mean hand may be missing from; matrices are complete.
  bool MayLackMean() const { return lacks_mean_[0] || lacks_mean_[1]; }
  /// Whether any was coefficients.
  bool HasCoefficients() const { return coefficients_ > 0; }
  /// Adds the mean hand to the fingers of the sides that may lack it.
  void AddMean(std::vector<JointPose>& pose);

  /// What was done: for ImportedClip::conventions and notes.
  std::vector<std::string> Conventions() const;
  std::vector<std::string> Notes() const;

 private:
  void Load(const std::filesystem::path& path);

  std::shared_ptr<const BodyModel> body_;
  std::array<std::optional<HandSpace>, 2> spaces_;   // by Side
  std::array<bool, 2> lacks_mean_ = {false, false};  // by Side
  int coefficients_ = 0;
  bool matrices_ = false, angles_ = false, mean_added_ = false, mean_of_body_ = false;
};

/// The numbers of one frame that an array of fingers has: 45 for angles, 90 for 6D, 135 for
/// matrices, fewer for coefficients. `frames` as for ReadRotations.
int NumbersPerHand(const DataValue& value, Eigen::Index frames = 0);

/// Whether the fingers of a clip are complete angles, from what they look like: relaxed fingers are
/// near the mean hand if so, near zero if they are differences from it. Nothing when undecided.
std::optional<bool> FingersLookFlat(const Clip& clip, const BodyModel& body);

}  // namespace holdfast
