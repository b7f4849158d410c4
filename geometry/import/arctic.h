// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/import/fields.h"
#include "geometry/import/imported_clip.h"

namespace holdfast {

/// Whether these are the fields of ARCTIC's `.smplx.npy` (the smplx package's names, no betas) or
/// `.mano.npy` (dicts `left` and `right` with rot, pose and trans).
bool LooksLikeArctic(const DataFile& file, const Fields& fields);

/// A raw sequence of ARCTIC (Fan et al., CVPR 2023), metres, 30 Hz. Finger angles of the body are
/// complete; those of `.mano.npy`, for a hand alone, are differences from MANO's mean hand.
/// `<sequence>.object.npy` beside it is the object: a row is its articulation (radians), axis-angle
/// (column vectors) and translation in MILLIMETRES. It has two parts; the clip's object is the
/// base, and the articulation is dropped. The object's mesh, also in millimetres, and the subject's
/// surface and gender are looked for in the data set's `meta`. Throws Error naming the field.
ImportedClip ImportArctic(const Fields& fields, const std::filesystem::path& path,
                          const ParameterOptions& options);

}  // namespace holdfast
