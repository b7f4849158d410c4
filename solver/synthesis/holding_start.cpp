// SPDX-License-Identifier: MIT
#include "solver/synthesis/holding_start.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "generator/actions/standing_start.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/seed.h"
#include "solver/actions/action_clip.h"

namespace holdfast {
namespace {

constexpr int kTries = 6;  // per start, in different styles
constexpr int kGrips = 2;  // for a striking tool: only the best grasps are firm

std::unique_ptr<const ActionProp> PropOf(const LoadedObject& object, bool mirrored, int threads) {
  return std::make_unique<const ActionProp>(MakeActionProp(
      object.name, object.mesh, ForFitting(object, kPairVertices, nullptr), mirrored, threads));
}

// Removes grasps that cover the part that is bitten, if there are others. Right-hand grasps.
void LeaveFreeWhatIsBitten(const ObjectMarks& marks, std::vector<Grasp>& grasps) {
  constexpr double kCovers_m = 0.07;
  const Eigen::Vector3d middle(-0.09, -0.03, 0.0);  // of the closed hand, in the wrist's frame
  const auto covers = [&](const Grasp& grasp) {
    return (grasp.wrist_from_object * marks.tip - middle).norm() < kCovers_m;
  };
  if (!std::ranges::all_of(grasps, covers)) std::erase_if(grasps, covers);
}

}  // namespace

HoldingStart StartInClip(const Clip& clip, const ClipBody& body, const LoadedObject& object,
                         std::optional<int> frame, int threads, const std::string& source) {
  if (body.model->LoneHand()) {
    throw Error(source, "shows a hand alone", "Give a clip of a whole body");
  }
  RequireMeters(source, clip, *body.model);
  const int frames = clip.NumFrames();
  if (frame && *frame >= frames) {
    throw Error(source, fmt::format("has frames 0 to {}, and no {}", frames - 1, *frame),
                "Give one of those");
  }
  HoldingStart start;
  start.clip = Slice(clip, 0, frame.value_or(frames - 1) + 1);
  const char* fix =
      "Give a clip and frame with the object in a hand, as 'holdfast fit' and 'holdfast grasp' "
      "make them, or none: then a start is made";
  if (!start.clip.object) throw Error(source, "has no object track", fix);
  if (start.clip.holding_hand.empty() || start.clip.holding_hand.back() == 0) {
    throw Error(source, "nobody holds the object in that frame", fix);
  }
  start.mirrored = start.clip.holding_hand.back() == kHoldsLeft;
  start.actor = std::make_unique<const ActionActor>(body.model, body.betas);
  if (start.mirrored) {
    start.clip = MirrorClip(start.clip, start.actor->Measures().rest_joints.col(0));
  }
  start.prop = PropOf(object, start.mirrored, threads);
  return start;
}

StandingHold MakeStandingHold(const ClipBody& body, const LoadedObject& object,
                              std::string_view action, const StandingHoldOptions& options) {
  if (body.model->LoneHand()) {
    throw Error(body.model->Name(), "is a hand alone: it cannot do anything with an object",
                "Give a whole body");
  }
  StandingHold hold;
  HoldingStart& start = hold.start;
  start.mirrored = options.left;
  start.actor = std::make_unique<const ActionActor>(body.model, body.betas);
  start.prop = PropOf(object, options.left, options.threads);
  const ActionProp& prop = *start.prop;
  const HandModel &right = start.actor->Hand(Side::kRight), &left = start.actor->Hand(Side::kLeft);
  const ActionObject shape{prop.mesh, prop.surface, *prop.fit.distance};
  std::vector<Grasp> grasps =
      FindActionGrasps(right, shape, options.seed, kGraspChoice, &hold.grasp, options.threads);
  if (grasps.empty()) return hold;
  AddTurnedOver(prop.marks, grasps);
  if (action == "eat" && prop.marks.size.x() > 2.0 * prop.marks.size.y()) {
    LeaveFreeWhatIsBitten(prop.marks, grasps);
  }
  std::vector<GraspPair> pairs;
  if (action == "offhand") {
    pairs = FindGraspPairs(right, left, shape, grasps, options.seed, kPairTries);
  }
  const auto begin = [&](const ActionGrasps& choices, std::optional<bool> in_hand) {
    ActionClip made;
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const std::uint64_t seed = MixSeed(options.seed, static_cast<std::uint64_t>(attempt));
      const StandingStart standing = OwnStanding(start.actor->Measures(), seed);
      made = MakeActionStart({action, *start.actor, prop, choices, standing, false, seed}, in_hand);
      if (made.fault.empty()) break;
    }
    return made;
  };
  ActionClip made;
  made.fault = "no grip";
  // Striking requires the handle in the palm, which is not how it is taken from a table.
  if (action == "use" && options.in_hand.value_or(true)) {
    std::vector<Grasp> grips = FindToolGrips(right, shape, options.seed, kGrips, options.threads);
    AddTurnedOver(prop.marks, grips);
    if (!grips.empty()) made = begin(ActionGrasps(*start.actor, std::move(grips), {}), true);
  }
  if (!made.fault.empty()) {
    made = begin(ActionGrasps(*start.actor, std::move(grasps), std::move(pairs)), options.in_hand);
  }
  hold.status = made.fault.empty() ? StandingHoldStatus::kMade : StandingHoldStatus::kNobodyCan;
  hold.fault = made.fault;
  hold.detail = made.detail;
  start.clip = std::move(made.clip);
  return hold;
}

}  // namespace holdfast
