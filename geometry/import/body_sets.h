// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/import/fields.h"

namespace holdfast {

/// Whether these are the sequences of OMOMO (Li et al. 2023), a dict each, or one of them.
bool LooksLikeOmomo(const Fields& fields);
/// Imports the sequence of that number (--person): a person of SMPL-X and an object, x = s R x + t;
/// z-up, 30 Hz.
ImportedClip ImportOmomo(const Fields& fields, const std::filesystem::path& path,
                         const ParameterOptions& options);

/// Whether these are SMPL parameters of MDM (Tevet et al. 2023), *_smpl_params.npy.
bool LooksLikeMdm(const Fields& fields);
/// Imports them: thetas (24, 6, T), two rows of each matrix; root_translation (3, T); y-up, 20 Hz.
ImportedClip ImportMdm(const Fields& fields, const std::filesystem::path& path,
                       const ParameterOptions& options);

}  // namespace holdfast
