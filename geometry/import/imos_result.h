// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/import/fields.h"

namespace holdfast {

/// Key frames a second of IMoS, whose files do not tell: between a 20th of the time of contact and
/// the 8 to 10 that the paper quotes (section 4 there), and what its 15 frames were drawn at.
inline constexpr double kImosFrameRate = 10;

/// Whether these are the fields of a result of IMoS's code: dicts `sbj_p` and `obj_p`.
bool LooksLikeImos(const Fields& fields);

/// A result of the public code of IMoS (Ghosh et al., Eurographics 2023): a torch archive that is
/// named .npz, 15 key frames, z-up, the origin at the subject's first place (the floor about 1 m
/// below it). All layouts that its scripts and samples have: rotations as axis-angle or as
/// matrices, gender as a word or a number, the subject's surface as `sbj_vtemp` or
/// `sbj_p.v_template`.
///
/// Object rotations act on row vectors (v R + t) and are transposed. Matrices that are no rotations
/// (nine free numbers were fitted in some samples) become the nearest one, and the notes say how
/// far off they were. Hands of 45 numbers are axis-angle: their third joints are exactly zero,
/// which no principal components would give. Throws Error naming the field.
ImportedClip ImportImos(const Fields& fields, const std::filesystem::path& path,
                        const ParameterOptions& options);

}  // namespace holdfast
