// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

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

}  // namespace holdfast
