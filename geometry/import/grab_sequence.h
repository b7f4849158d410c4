// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "geometry/import/fields.h"

namespace holdfast {

/// Whether these are the fields of a GRAB sequence: dicts `body` and `object`, with their hands,
/// contact or intent beside them.
bool LooksLikeGrab(const Fields& fields);

/// A sequence of GRAB (Taheri et al., ECCV 2020) as it is downloaded: `grab/<subject>/*.npz`.
///
/// The world is z-up, meters, 120 Hz. The body is SMPL-X; its final pose is `fullpose`, complete
/// (without it, the 24 hand coefficients need a hand model). Objects and tables act on row vectors,
///   v_world = v R + t,
/// so their rotation is transposed: the axis-angle negated. The subject's surface comes from the
/// .ply that `body.vtemp` names. Who holds, per frame, from the labels on the object: right where
/// any vertex has 22 or 41..55, left for 21 or 26..40. A hand alone takes `rhand` or `lhand`, which
/// are MANO in the world: root_orient is the wrist's, `fullpose` the fingers, flat.
/// Throws Error naming the field.
ImportedClip ImportGrab(const Fields& fields, const std::filesystem::path& path,
                        const ParameterOptions& options);

/// The hands that touch the object by GRAB's labels of one frame (bits as Clip::holding_hand).
std::uint8_t HandsTouching(std::span<const std::uint8_t> labels);

/// Whether these are the fields of ARCTIC's `.smplx.npy` (the smplx package's names, no betas) or
/// `.mano.npy` (dicts `left` and `right` with rot, pose and trans).
bool LooksLikeArctic(const DataFile& file, const Fields& fields);

/// A raw sequence of ARCTIC (Fan et al., CVPR 2023), meters, 30 Hz. Finger angles of the body are
/// complete; those of `.mano.npy`, for a hand alone, are differences from MANO's mean hand.
/// `<sequence>.object.npy` beside it is the object: a row is its articulation (radians), axis-angle
/// (column vectors) and translation in MILLIMETERS. It has two parts; the clip's object is the
/// base, and the articulation is dropped. The object's mesh, also in millimeters, and the subject's
/// surface and gender are looked for in the data set's `meta`. Throws Error naming the field.
ImportedClip ImportArctic(const Fields& fields, const std::filesystem::path& path,
                          const ParameterOptions& options);

}  // namespace holdfast
