// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/conventions/loose_motion.h"
#include "geometry/inspect/inspection.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

// Turns measurements of a motion into facts, findings and commands of its inspection.

/// Reports whether finger poses are full rotations or differences from the mean hand.
void DescribeHands(const LooseMotion& motion, const BodyModel& body, Inspection& inspection);

/// Reports whether the object rotation is for rows or columns, and which hand carries the object.
void DescribeObject(const LooseMotion& motion, const BodyModel& body, double meters_per_unit,
                    Inspection& inspection);

/// Unless the motion is of a hand alone, reports the up axis, the unit of the root position, the
/// ground height, discontinuities, joints bent beyond their limits, and the order of the joints.
/// Returns the meters per unit of `trans`.
double DescribeBodyMotion(const LooseMotion& motion, const BodyModel& body, Inspection& inspection);

/// Reports that a clip of a hand alone needs its own model, since it fits no body. If the model is
/// next to the file, proposes commands with it. `word`: clip in commands; `stem`: name of results.
void ProposeForHandAlone(const Clip& clip, const std::string& word, const std::string& stem,
                         Inspection& inspection);

/// Reports how a clip of another model changes on `body`: the shift of trans, and the distance from
/// the object (`mesh`) to the hands that hold it according to the clip.
void DescribeOnBody(const Clip& clip, const std::optional<TriangleMesh>& mesh,
                    const std::shared_ptr<const BodyModel>& body, Inspection& inspection);

}  // namespace holdfast
