// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/import/fields.h"

namespace holdfast {

/// Whether these are the fields of a result of the IMoS code: dicts `sbj_p` and `obj_p`.
bool LooksLikeImos(const Fields& fields);

/// Imports a result of the public code of IMoS (Ghosh et al., Eurographics 2023): a torch archive
/// named .npz, 15 key frames, z-up, origin at the subject's initial position (the floor about 1 m
/// below it). Accepts all layouts of its scripts and samples: rotations as axis-angle or matrices,
/// gender as a word or a number, the subject's surface as `sbj_vtemp` or `sbj_p.v_template`.
/// `sbj_p.v_template`.
///
/// Object rotations act on row vectors (v R + t) and are transposed. Matrices that are not
/// rotations (some samples fitted nine free numbers) become the nearest one; notes report how far
/// off they were. Hands of 45 numbers are axis-angle: their third joints are exactly zero, which
/// principal components would not give. Throws Error naming the field.
ImportedClip ImportImos(const Fields& fields, const std::filesystem::path& path,
                        const ParameterOptions& options);

}  // namespace holdfast
