// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/import/fields.h"
#include "geometry/io/pickle/data_file.h"

namespace holdfast {

/// Whether these are the sequences of OMOMO (Li et al. 2023), a dict each, or one of them.
bool LooksLikeOmomo(const Fields& fields);
/// Imports the sequence of that number (--person): a person of SMPL-X and an object, x = s R x + t;
/// z-up, 30 Hz.
ImportedClip ImportOmomo(const Fields& fields, const std::filesystem::path& path,
                         const ParameterOptions& options);

/// Whether this is smplx/NAME.npz of HIMO (Lv et al. 2024), with object_pose/NAME.npy beside its
/// folder.
bool LooksLikeHimo(const DataFile& file, const Fields& fields);
/// Imports the person, and the object that ChooseObject takes. y-up, 30 Hz.
ImportedClip ImportHimo(const DataFile& file, const Fields& fields,
                        const ParameterOptions& options);

/// Whether this is smplx_seq/sN/smplx_pose.pkl of ParaHome (Kim et al. 2024).
bool LooksLikeParaHome(const DataFile& file, const Fields& fields);
/// Imports the person, the shape of smplx_params.pkl beside it, and of
/// seq/sN/object_transformations.pkl the object that ChooseObject takes. z-up, 30 Hz.
ImportedClip ImportParaHome(const DataFile& file, const Fields& fields,
                            const ParameterOptions& options);

/// Whether these are SMPL parameters of MDM (Tevet et al. 2023), *_smpl_params.npy.
bool LooksLikeMdm(const Fields& fields);
/// Imports them: thetas (24, 6, T), two rows of each matrix; root_translation (3, T); y-up, 20 Hz.
ImportedClip ImportMdm(const Fields& fields, const std::filesystem::path& path,
                       const ParameterOptions& options);

}  // namespace holdfast
