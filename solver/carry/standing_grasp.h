// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/mesh/load_object.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_set.h"

namespace holdfast {

/// A grasp, and one frame of who holds the object with it.
struct StandingGrasp {
  Grasp grasp;
  GraspReport report;
  Clip clip;  ///< without frames unless `report.status` is kFound
};

/// Closes a hand of the mean shape around the object, and puts it to a standing person whose
/// forearm is turned so that the object is as upright as can be and held far enough out to clear
/// the body, feet at z = 0; a hand alone stays by itself, the wrist 1 m up. `options.up_in_wrist`
/// is filled in with the ways that a forearm can turn. Throws Error as CloseHand does.
StandingGrasp GraspStanding(const std::shared_ptr<const BodyModel>& body, Side side,
                            const LoadedObject& object, GraspOptions options = {},
                            const GraspProgress& progress = {});

/// Many grasps, and who holds the object with them.
struct StandingGraspSet {
  GraspSet set;
  Clip clip;  ///< a frame for each of the first `kMostShown` grasps; none where there is none
};
inline constexpr int kMostShown = 100;

/// The same for many distinct grasps (FindGrasps), which the object's uprightness does not rank.
/// Throws Error as FindGrasps does.
StandingGraspSet GraspsStanding(const std::shared_ptr<const BodyModel>& body, Side side,
                                const LoadedObject& object, const GraspSetOptions& options,
                                const GraspProgress& progress = {});

/// One frame of a person of the mean shape who stands with both forearms forward, feet at z = 0:
/// where HoldInBothHands may start from.
Clip StandWithForearmsForward(const std::shared_ptr<const BodyModel>& body);

/// Gives a clip of one frame an object of this name there (metres), held by these hands.
void PutInHands(std::uint8_t hands, const std::string& name,
                const Eigen::Isometry3d& world_from_object, Clip& clip);

}  // namespace holdfast
