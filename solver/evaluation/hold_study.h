// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/clip/clip_body.h"
#include "geometry/io/mesh/load_object.h"
#include "solver/grasp/grasp.h"
#include "solver/trial/trial_clip.h"

namespace holdfast {

/// How an object's grasps are found and tried: on `protocol.threads` threads.
struct HoldStudyOptions {
  TrialProtocol protocol;
  std::uint64_t seed = 0;
};

/// An object's first grasp, tried.
struct HoldRow {
  std::string object, fault;  ///< fault: why there is no grasp, and so no trial
  ClipScene scene;            ///< a standing person with it (GraspStanding)
  std::optional<ClipTrial> trial;
  double trial_s = 0.0;
};

/// The grasp that `grasp` makes, in MuJoCo. Nothing when `progress` stopped the search. Throws
/// Error without MuJoCo, and for an object without volume.
std::optional<HoldRow> TryFirstGrasp(const std::shared_ptr<const BodyModel>& body,
                                     const LoadedObject& object, const HoldStudyOptions& options,
                                     const GraspProgress& progress = {});

/// Many distinct grasps of one object (FindGrasps), tried: a trial each.
struct HoldSetRow {
  std::string object;
  std::vector<HoldTrial> trials;
  int NumHeld() const;  ///< in all six directions
};

/// As TryFirstGrasp, for up to `count` grasps; `progress` gets the share of the trials that is
/// done.
std::optional<HoldSetRow> TryManyGrasps(const HandModel& hand, const LoadedObject& object,
                                        int count, const HoldStudyOptions& options,
                                        const GraspProgress& progress = {});

}  // namespace holdfast
