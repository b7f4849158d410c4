// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/conventions/loose_motion.h"
#include "geometry/conventions/posture.h"
#include "geometry/inspect/inspection.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

// What the measurements of a motion mean, as facts, findings and commands of its inspection.

/// Up axis, unit of the root's position, height of the ground.
void DescribePosture(const LooseMotion& motion, const Posture& posture, Inspection& inspection);

/// Full finger rotations or differences from the mean hand.
void DescribeHands(const LooseMotion& motion, const BodyModel& body, Inspection& inspection);

/// Row or column rotation of the object, and the hand that carries it.
void DescribeObject(const LooseMotion& motion, const BodyModel& body, double meters_per_unit,
                    Inspection& inspection);

/// Leaps, joints bent too far, order of the joints.
void DescribeMotion(const LooseMotion& motion, double meters_per_unit, Inspection& inspection);

/// DescribePosture and DescribeMotion, neither of which says anything of a hand alone. Returns the
/// meters per unit of `trans`.
double DescribeBodyMotion(const LooseMotion& motion, const BodyModel& body, Inspection& inspection);

/// A hand alone goes onto no body: says that its own model is needed, and proposes commands with it
/// where it lies beside the file. `word` is the clip in commands, `stem` the name of results.
void ProposeForHandAlone(const Clip& clip, const std::string& word, const std::string& stem,
                         Inspection& inspection);

/// What a clip of another model becomes on `body`: where its trans goes, and how far the hands that
/// it says hold the object (`mesh`) are from it then.
void DescribeOnBody(const Clip& clip, const std::optional<TriangleMesh>& mesh,
                    const std::shared_ptr<const BodyModel>& body, Inspection& inspection);

// Commands that set a clip right, ready to paste into a shell.

/// A clip whose world has `sign` times `axis` up, turned z-up.
std::string TurnUpCommand(const std::filesystem::path& path, int axis, int sign);

/// A clip with `trans` (and the object's) multiplied.
std::string ScaleCommand(const std::filesystem::path& path, double factor);

/// A clip with the object's rotation transposed; takes Python with numpy.
std::string TransposeObjectCommand(const std::filesystem::path& path);

}  // namespace holdfast
