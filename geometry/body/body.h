// SPDX-License-Identifier: MIT
#pragma once

/// Body models: SMPL-X, SMPL-H and MANO files come in; a shaped surface posed by 55 joints comes
/// out, for one hand with Jacobians.
///
/// From the inside out:
///   skeleton.h             55 joints: names, parents, sides, mirroring
///   rest_pelvis.h          J_0 of the published mean shapes and of the embedded body
///   smplx_hand_vertices.h  MANO's 778 vertices in SMPL-X
///   body_layouts.h         SMPL-H and MANO as 55 joints
///   linear_basis.h         shape and pose directions as stored
///   body_model_fields.h    arrays of a model file, any format
///   body_model.h           BodyModel, and BodySurface of one person
///   body_model_reader.h    fields read, checked, brought into 55 joints
///   vertex_adjoint.h       gradients by pose, trans and betas
///   body_frames.h          many frames at once, with gradients
///   end_site.h             where a limb ends on the skin
///   hand_parts.h           which joint of a hand moves each vertex most
///   hand_model.h           one hand by 45 numbers, with Jacobians
///   own_body.h             depth in a posed person's own skin
#include "geometry/body/body_model.h"
#include "geometry/body/hand_model.h"
#include "geometry/body/skeleton.h"
