// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "geometry/body/skeleton.h"
#include "geometry/import/fields.h"
#include "geometry/import/imported_clip.h"

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

}  // namespace holdfast
