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

/// Field names of the parameters of a hand alone.
struct HandFieldNames {
  std::string_view orient, pose;
  std::span<const std::string_view> trans, betas;  ///< the first that exists is used
};

/// Reads a MANO hand as a clip of a hand alone: `orient` and `trans` are its root, `pose` 15 joints
/// or coefficients. `flat`: whether these are complete or differences from the mean hand. A missing
/// translation becomes zero, with a warning. Sets no world frame. Throws Error naming the field.
ImportedClip ReadHandAlone(const Fields& fields, const HandFieldNames& names, Side side, bool flat,
                           const ParameterOptions& options);

/// Whether these are MANO parameters in the smplx package's names: `global_orient` and `hand_pose`
/// but no body, in the file or in a dict such as `pred_mano_params` (HaMeR).
bool LooksLikeMano(const Fields& fields);

/// Imports such parameters, with rotations in any form that ReadRotations accepts. The side comes
/// from `is_rhand` (in Holdfast's files) or `is_right`, else from the options; else it is right,
/// with a note. Finger angles follow `flat_hand_mean` in the file; without it they are relative to
/// the mean hand, the package's default. The object is taken from a file next to this one
/// (AddObjectBeside).
ImportedClip ImportMano(const Fields& fields, const std::filesystem::path& path,
                        const ParameterOptions& options);

/// Principal components and mean of one hand, as in SMPL-X and MANO files.
struct HandSpace {
  Eigen::MatrixXd components;  ///< (K x 45), one component per row
  Eigen::Matrix<double, kHandDofs, 1> mean;
};

/// Converts the numbers of a file to finger angles (the smplx package's terms):
///   angles = coefficients * components[0:n] + (flat_hand_mean ? 0 : mean)
/// and, for numbers that are already angles, angles = numbers + (flat_hand_mean ? 0 : mean).
class FingerAngles {
 public:
  /// Reads hands_componentsl/r and hands_meanl/r (SMPL-X), or hands_components and hands_mean
  /// (MANO; side by the file name, MANO_LEFT or MANO_RIGHT), from each of `options.hand_models`.
  /// Throws Error for a file with neither.
  explicit FingerAngles(const ParameterOptions& options);

  /// Returns finger angles (45 x T) of an array of fingers: rotations in any form that
  /// ReadRotations accepts, or n < 45 coefficients per frame. Adds no mean. `frames` as in
  /// ReadRotations. Throws Error for coefficients without components.
  Eigen::MatrixXd Read(const DataValue& value, Side side, ImportedClip& imported,
                       Eigen::Index frames = 0);

  /// The same of rows (45 x T) that hold angles, or coefficients of all components.
  Eigen::MatrixXd OfAngles(const Eigen::MatrixXd& rows, Side side);
  Eigen::MatrixXd OfCoefficients(const Eigen::MatrixXd& rows, Side side, const std::string& where);

  /// Whether anything read may lack the mean hand; matrices are complete.
  bool MayLackMean() const { return lacks_mean_[0] || lacks_mean_[1]; }
  /// Whether any coefficients were read.
  bool HasCoefficients() const { return coefficients_ > 0; }
  /// Adds the mean hand to the fingers of the sides that may lack it.
  void AddMean(std::vector<JointPose>& pose);

  /// Descriptions of what was done, for ImportedClip::conventions and notes.
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

/// Numbers per frame in an array of fingers: 45 for angles, 90 for 6D, 135 for matrices, fewer for
/// coefficients. `frames` as in ReadRotations.
int NumbersPerHand(const DataValue& value, Eigen::Index frames = 0);

/// Whether the fingers of a clip are complete angles, judged from relaxed fingers: complete angles
/// are near the mean hand, differences from it near zero. nullopt if undecided.
std::optional<bool> FingersLookFlat(const Clip& clip, const BodyModel& body);

}  // namespace holdfast
