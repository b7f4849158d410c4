// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include "geometry/clip/clip_body.h"

namespace holdfast {

/// A clip that went from one kind of body model to another.
struct BodyChange {
  std::string from;        ///< the model that the clip was made with: "SMPL-X"
  Eigen::Vector3d offset;  ///< added to trans, metres
};

/// Brings a clip onto `body` (as BodyOfClip gives it) where it was made with a model of another
/// kind: SMPL-X, SMPL-H, or the embedded body. A root turns about the pelvis J_0 of its own model's
/// rest pose, and joint 0 is at J_0 + trans, so the pelvis stays where it was with
///     trans' = trans + J_0 - J_0'.
/// J_0 of a model whose file is not there is its mean shape's, a few centimetres off for other
/// shapes. Betas and labels of the other model are dropped, and its surface, unless that has the
/// vertices of `body` and is what BodyOfClip took: the clip is `body`'s from then on. Nothing
/// happens to a clip of the same kind of model, or of a hand alone.
std::optional<BodyChange> BringOntoBody(Clip& clip, const ClipBody& body);

/// For people: from what to what, by how much, and how to keep the clip's own model.
std::string Describe(const BodyChange& change, const BodyModel& to);

}  // namespace holdfast
