// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "geometry/import/fields.h"

namespace holdfast {

/// Whether these are the fields of a GRAB sequence: dicts `body` and `object`, and at least one of
/// hands, contact and intent.
bool LooksLikeGrab(const Fields& fields);

/// Imports a sequence of GRAB (Taheri et al., ECCV 2020) as downloaded: `grab/<subject>/*.npz`.
///
/// The world is z-up, meters, 120 Hz. The body is SMPL-X; its final pose is `fullpose`, complete
/// (without it, the 24 hand coefficients need a hand model). Objects and tables act on row vectors,
///   v_world = v R + t,
/// so their rotation is transposed by negating the axis-angle. The subject's surface comes from the
/// .ply that `body.vtemp` names. The holding hands per frame come from the labels on the object:
/// right if any vertex has 22 or 41..55, left for 21 or 26..40. A hand alone comes from `rhand` or
/// `lhand`, MANO in the world: root_orient is the wrist's, `fullpose` the fingers (flat hand).
/// Throws Error naming the field.
ImportedClip ImportGrab(const Fields& fields, const std::filesystem::path& path,
                        const ParameterOptions& options);

/// Returns the hands that touch the object by the labels of one frame (bits: Clip::holding_hand).
std::uint8_t HandsTouching(std::span<const std::uint8_t> labels);

/// Whether these are the fields of ARCTIC's `.smplx.npy` (the smplx package's names, no betas) or
/// `.mano.npy` (dicts `left` and `right` with rot, pose and trans).
bool LooksLikeArctic(const DataFile& file, const Fields& fields);

/// Imports a raw sequence of ARCTIC (Fan et al., CVPR 2023), meters, 30 Hz. Finger angles of the
/// body are complete; those of `.mano.npy`, for a hand alone, are differences from MANO's mean
/// hand. `<sequence>.object.npy` next to it is the object: a row is articulation (radians),
/// axis-angle (column vectors), translation (MILLIMETERS). The object has two parts; the clip has
/// its base, without articulation. The object's mesh, also in millimeters, and the subject's
/// surface and gender come from the data set's `meta`. Throws Error naming the field.
ImportedClip ImportArctic(const Fields& fields, const std::filesystem::path& path,
                          const ParameterOptions& options);

}  // namespace holdfast
