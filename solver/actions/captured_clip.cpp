// SPDX-License-Identifier: MIT
#include "solver/actions/captured_clip.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "generator/imos/vocabulary.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/markers/marker_recording.h"
#include "solver/actions/action_measures.h"
#include "solver/actions/action_motion.h"
#include "solver/actions/captured_brush.h"
#include "solver/carry/carry.h"
#include "solver/markers/solve_markers.h"

namespace holdfast {
namespace {

std::vector<std::string> CapturedParts(const std::vector<int>& unmarked) {
  const auto moved = [&](std::initializer_list<int> joints) {
    return std::ranges::any_of(
        joints, [&](int joint) { return std::ranges::find(unmarked, joint) == unmarked.end(); });
  };
  std::vector<std::string> parts;
  if (moved({kSpine1, kSpine2, kSpine3})) parts.emplace_back("trunk");
  if (moved({kRightCollar, kRightShoulder, kRightElbow, kRightWrist})) {
    parts.emplace_back("right_arm");
  }
  if (moved({kLeftCollar, kLeftShoulder, kLeftElbow, kLeftWrist})) parts.emplace_back("left_arm");
  return parts;
}

// What the object stands on before it is lifted.
void AddTable(const ActionProp& prop, Clip& clip) {
  const Eigen::Isometry3d stands = clip.object->Pose(0);
  Eigen::Vector3d at = stands.translation();
  at.z() = (stands * prop.mesh.vertices).row(2).minCoeff();
  clip.table.emplace();
  clip.table->name = "table";
  clip.table->trans = at.replicate(1, clip.NumFrames());
  clip.table->orient = Eigen::Matrix3Xd::Zero(3, clip.NumFrames());
}

void MeasureKey(const ActionActor& actor, const ActionProp& prop, const CarryReport& carried,
                CapturedClip& made) {
  if (carried.drunk) {
    made.key_mean_m = made.key_worst_m = carried.drunk->rim_from_mouth_m;
    return;
  }
  for (int t = made.action.act; t < made.action.back; ++t) {
    const double off = std::abs(BristlesFromHead(actor, prop.marks, made.clip, t));
    made.key_mean_m += off / (made.action.back - made.action.act);
    made.key_worst_m = std::max(made.key_worst_m, off);
  }
}

// The clip with its object; false with a fault in `made`.
bool Carry(const CapturedClipRequest& request, CapturedClip& made, CarryReport& carried) {
  CarryOptions options;
  options.seed = request.seed;
  options.drink = made.action.action == "drink";
  if (!options.drink) {
    options.grasp = GraspSource::kClips;
    const BrushReport brush =
        ServeBrush(request.actor, request.prop, request.grasps, made.action.side, made.action.act,
                   made.action.back, made.clip);
    if (brush.grasp == nullptr) {
      made.fault = "no grasp";
      return false;
    }
  }
  const ClipBody body{request.model, request.actor.Betas()};
  try {
    carried = CarryObject(made.clip, body, request.object, options);
  } catch (const Error& error) {
    made.fault = options.drink ? "nobody drinks" : "nobody holds";
    made.detail = error.what();
    return false;
  }
  if (carried.status != CarryStatus::kCarried) {
    made.fault = "no grasp";
    made.detail = carried.grasp.status;
    return false;
  }
  return true;
}

}  // namespace

CapturedTrial ReadCapturedTrial(const MarkerTrialFiles& files,
                                const std::shared_ptr<const BodyModel>& model) {
  if (files.still.empty()) {
    throw Error(files.recording.string(), "has no static trial beside it",
                "Put the person's static trial, named ..._static..., into its folder");
  }
  const MarkerRecording still = ReadMarkers(files.still);
  const SolvedRecording solved =
      SolveMarkers(ReadMarkers(files.recording), &still, model, {}, files.recording.string());
  CapturedTrial trial;
  trial.clip = Resample(solved.clip, kActionRate);
  const BodySurface surface(model, trial.clip.betas);
  trial.person = {surface.RestJoints(), FindFaceMarks(surface)};
  const auto action = FindCapturedAction(trial.clip, trial.person);
  if (!action) {
    throw Error(files.recording.string(), "has no hand that drinks or goes over the head",
                "Give trials of somebody who drinks from a table, or combs");
  }
  trial.action = *action;
  trial.parts = CapturedParts(solved.report.unmarked);
  return trial;
}

CapturedClip MakeCapturedClip(const CapturedClipRequest& request) {
  const CapturedAction& captured = request.trial.action;
  const ActionActor& actor = request.actor;
  CapturedClip made;
  made.action = captured;
  made.action.begin = 0;
  for (int* const frame :
       {&made.action.act, &made.action.key, &made.action.back, &made.action.end}) {
    *frame -= captured.begin;
  }
  made.clip = RetargetCaptured(request.trial.clip, captured, request.trial.person, actor.Measures(),
                               actor.Face(), request.posture,
                               IdleMotion(actor.Measures(), request.start, 1).front());
  made.clip.betas = actor.Betas();
  made.clip.body_model = actor.Model().Name();
  CarryReport carried;
  if (!Carry(request, made, carried)) return made;
  made.clip = std::move(carried.clip);
  made.clip.action = captured.action;
  made.clip.object->name = imos::VocabularyName(request.prop.name);
  if (carried.drunk) AddTable(request.prop, made.clip);
  MeasureAction(actor, request.prop, made.clip, made.quality);
  MeasureKey(actor, request.prop, carried, made);
  made.in_body_frames = carried.clearance.deep;
  made.in_object_frames =
      static_cast<int>(std::lround(made.quality.penetrating * made.clip.NumFrames()));
  const ActionFault fault = FaultOf(made.quality, captured.action);
  made.fault = fault.fault;
  made.detail = fault.detail;
  if (made.fault.empty() && made.key_mean_m > kMostFromKey_m) {
    made.fault = carried.drunk ? "rim misses the mouth" : "bristles miss the head";
    made.detail = fmt::format("by {:.0f} mm", 1e3 * made.key_mean_m);
  }
  return made;
}

}  // namespace holdfast
