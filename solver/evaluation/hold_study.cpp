// SPDX-License-Identifier: MIT
#include "solver/evaluation/hold_study.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "solver/carry/first_grasp.h"
#include "solver/carry/standing_grasp.h"
#include "solver/trial/trial_grasps.h"

namespace holdfast {

int HoldSetRow::NumHeld() const {
  return static_cast<int>(std::ranges::count_if(
      trials, [](const HoldTrial& trial) { return trial.Held() == kTrialDirections; }));
}

std::optional<HoldRow> TryFirstGrasp(const std::shared_ptr<const BodyModel>& body,
                                     const LoadedObject& object, const HoldStudyOptions& options,
                                     const GraspProgress& progress) {
  HoldRow row;
  row.object = object.name;
  if (const auto why = WhyTooLarge(object, false)) {
    row.fault = *why;
    return row;
  }
  GraspOptions grasp;
  grasp.seed = options.seed;
  grasp.threads = options.protocol.threads;
  bool stopped = false;
  StandingGrasp held = GraspStanding(body, body->LoneHand().value_or(Side::kRight), object, grasp,
                                     [&](double share) {
                                       stopped = stopped || (progress && !progress(share));
                                       return !stopped;
                                     });
  if (stopped) return std::nullopt;
  if (held.report.status != GraspStatus::kFound) {
    row.fault = Describe(held.report.status);
    return row;
  }
  row.scene.source = object.name;
  row.scene.betas = held.clip.betas;
  row.scene.clip = std::move(held.clip);
  row.scene.body = body;
  row.scene.object = object.mesh;
  const auto begin = std::chrono::steady_clock::now();
  row.trial = TryClip(row.scene, options.protocol);
  row.trial_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return row;
}

std::optional<HoldSetRow> TryManyGrasps(const HandModel& hand, const LoadedObject& object,
                                        int count, const HoldStudyOptions& options,
                                        const GraspProgress& progress) {
  GraspSetOptions set_options;
  set_options.count = count;
  set_options.search.seed = options.seed;
  set_options.search.threads = options.protocol.threads;
  DistanceGridOptions grid_options;
  grid_options.threads = options.protocol.threads;
  const DistanceGrid grid(SignedDistance(object.mesh), grid_options);
  bool stopped = false;
  const auto going = [&](double share) {
    stopped = stopped || (progress && !progress(share));
    return !stopped;
  };
  const GraspSet set =
      FindGrasps(hand, object.mesh, grid, set_options, [&](double) { return going(0.0); });
  if (stopped) return std::nullopt;
  HoldSetRow row{object.name, TryGrasps(hand, object.mesh, set.grasps, options.protocol, going)};
  if (stopped) return std::nullopt;
  return row;
}

}  // namespace holdfast
