// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// The body of one person.
struct ClipBody {
  std::shared_ptr<const BodyModel> model;  ///< with the subject's own surface where it is known
  Eigen::VectorXd betas;                   ///< of that model
};

/// The body of the person in a clip: `model` with the clip's v_template, the subject's own surface,
/// where it has the model's vertices; else with the clip's betas where they are the model's. What
/// is not used, and why, goes into `notes`. Throws Error, named `source`, for a clip of a hand
/// alone and a whole body, or the other way round.
ClipBody BodyOfClip(const std::string& source, const Clip& clip,
                    std::shared_ptr<const BodyModel> model, std::vector<std::string>& notes);

/// Whether a clip moves a hand that hangs on no body (MANO): root_orient and trans are the wrist's.
bool IsHandAlone(const Clip& clip);
/// Makes it one: what the field calls such files.
void MarkHandAlone(Clip& clip);

/// Throws Error when the model lacks one of the hands that `bits` (kHoldsRight, kHoldsLeft) name.
void RequireHands(const BodyModel& model, std::uint8_t bits);

/// A clip that went from one kind of body model to another.
struct BodyChange {
  std::string from;        ///< the model that the clip was made with: "SMPL-X"
  Eigen::Vector3d offset;  ///< added to trans, meters
};

/// Brings a clip onto `body` (as BodyOfClip gives it) where it was made with a model of another
/// kind: SMPL-X, SMPL-H, or the embedded body. A root turns about the pelvis J_0 of its own model's
/// rest pose, and joint 0 is at J_0 + trans, so the pelvis stays where it was with
///     trans' = trans + J_0 - J_0'.
/// J_0 of a model whose file is not there is its mean shape's, a few centimeters off for other
/// shapes. Betas and labels of the other model are dropped, and its surface, unless that has the
/// vertices of `body` and is what BodyOfClip took: the clip is `body`'s from then on. Nothing
/// happens to a clip of the same kind of model, or of a hand alone.
std::optional<BodyChange> BringOntoBody(Clip& clip, const ClipBody& body);

/// For people: from what to what, by how much, and how to keep the clip's own model.
std::string Describe(const BodyChange& change, const BodyModel& to);

/// A clip with all that it takes to see or measure it.
struct ClipScene {
  std::string source;  ///< what messages call it
  Clip clip;
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;               ///< of that body
  bool foreign_body = false;           ///< the clip was made, and fitted, with another body model
  std::string made_with;               ///< which one
  std::optional<TriangleMesh> object;  ///< full resolution, in the object's own frame
  std::string object_source;           ///< where it came from, for LoadObject
  std::string object_missing;          ///< why there is none, for a clip that has an object track

  /// The vertices of the body in the clip: shaped, of the body model that was loaded.
  BodySurface Surface() const { return BodySurface(body, betas); }
};

}  // namespace holdfast
