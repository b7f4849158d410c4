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
  std::shared_ptr<const BodyModel> model;  ///< with the subject's own surface if known
  Eigen::VectorXd betas;                   ///< of that model
};

/// Returns the body of the person in a clip: `model` with the clip's v_template, the subject's own
/// surface, if it has the model's vertex count; otherwise with the clip's betas, if they are the
/// model's. A hand-only clip and the embedded body give the embedded hand (DefaultHand). Unused
/// data and the reason are appended to `notes`. Throws Error, with `source` as location, for a
/// hand-only clip and another whole body, or vice versa.
ClipBody BodyOfClip(const std::string& source, const Clip& clip,
                    std::shared_ptr<const BodyModel> model, std::vector<std::string>& notes);

/// Whether a clip is a hand-only motion (MANO): root_orient and trans are the wrist's.
bool IsHandAlone(const Clip& clip);
/// Marks a clip as hand-only by its surface_model_type ("mano").
void MarkHandAlone(Clip& clip);
/// Returns the side of a hand-only clip: that of the fingers that bend, else of the hand that
/// holds, else right.
Side SideOfHandAlone(const Clip& clip);

/// Throws Error if the model lacks one of the hands in `bits` (kHoldsRight, kHoldsLeft).
void RequireHands(const BodyModel& model, std::uint8_t bits);

/// Conversion of a clip from one kind of body model to another.
struct BodyChange {
  std::string from;        ///< the original model: "SMPL-X"
  Eigen::Vector3d offset;  ///< added to trans, meters
};

/// Converts a clip to `body` (from BodyOfClip) if it was made with a model of another kind: SMPL-X,
/// SMPL-H, or the embedded body. The root rotates about the pelvis J_0 of its model's rest pose,
/// and joint 0 is at J_0 + trans, so the pelvis stays in place with
///     trans' = trans + J_0 - J_0'.
/// For a model whose file is not available, J_0 is its mean shape's, a few centimeters off for
/// other shapes. Betas and labels of the other model are dropped; its surface is dropped unless it
/// has the vertex count of `body` and BodyOfClip used it. The clip then belongs to `body`. A clip
/// of the same kind of model, or a hand-only clip, is unchanged.
std::optional<BodyChange> BringOntoBody(Clip& clip, const ClipBody& body);

/// Describes a change: the models, the offset, and how to keep the clip's own model.
std::string Describe(const BodyChange& change, const BodyModel& to);

/// A clip with everything needed to display or measure it.
struct ClipScene {
  std::string source;  ///< name in messages
  Clip clip;
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;               ///< of that body
  bool foreign_body = false;           ///< the clip was made, and fitted, with another body model
  std::string made_with;               ///< that model
  std::optional<TriangleMesh> object;  ///< full resolution, in the object's own frame
  std::string object_source;           ///< its origin, for LoadObject
  std::string object_missing;          ///< reason if a clip with an object track has no object

  /// Vertices of the person's body, of the loaded body model.
  BodySurface Surface() const { return BodySurface(body, betas); }
};

}  // namespace holdfast
