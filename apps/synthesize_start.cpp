// SPDX-License-Identifier: MIT
#include "apps/synthesize_start.h"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

#include "apps/action_plan.h"
#include "apps/clip_input.h"
#include "apps/reach_job.h"
#include "generator/actions/standing_start.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/seed.h"
#include "solver/actions/action_clip.h"

namespace holdfast::apps {
namespace {

constexpr int kGrasps = 14;    // that the hand may choose from
constexpr int kPairTries = 5;  // of them that the other hand is found a grasp for
constexpr int kTries = 6;      // of a start, in other styles
constexpr int kPairVertices = 300;

// The person of the clip at its frame, up to it.
HeldStart FromClip(const SynthesisBegin& begin, const CommonOptions& common) {
  const auto [name, frame] = ParseStart(begin.from);
  ClipInputOptions options;
  options.body = begin.body;
  options.object = begin.object;
  options.object_scale = begin.object_scale;
  ClipInput input = LoadClipInput(name, options, common);
  if (input.body->LoneHand()) {
    throw Error(name, "shows a hand alone", "Give a clip of a whole body");
  }
  RequireMetres(name, input.clip, *input.body);
  const int frames = input.clip.NumFrames();
  if (frame && *frame >= frames) {
    throw Error(begin.from, fmt::format("the clip has frames 0 to {}", frames - 1),
                "Give one of those");
  }
  HeldStart start;
  start.clip = Slice(input.clip, 0, frame.value_or(frames - 1) + 1);
  const char* fix =
      "Give a clip and frame with the object in a hand, as 'holdfast fit' and 'holdfast grasp' "
      "make them, or none: then a start is made";
  if (!start.clip.object) throw Error(begin.from, "has no object track", fix);
  if (start.clip.holding_hand.empty() || start.clip.holding_hand.back() == 0) {
    throw Error(begin.from, "nobody holds the object in that frame", fix);
  }
  start.mirrored = start.clip.holding_hand.back() == kHoldsLeft;
  if (start.mirrored) start.clip = MirrorClip(start.clip);
  start.actor = std::make_unique<const ActionActor>(input.body, input.betas);
  start.how = {{"from", name}, {"frame", start.clip.NumFrames() - 1}};
  return start;
}

// A person who stands and has the object in the hand, on a table or before the waist.
HeldStart Made(const SynthesisBegin& begin, const imos::Intent& intent, const LoadedObject& object,
               const CommonOptions& common) {
  const std::shared_ptr<const BodyModel> body = LoadBody(begin.body);
  if (body->LoneHand()) {
    throw Error(body->Name(), "is a hand alone: it cannot do anything with an object",
                "Give a whole body");
  }
  if (static_cast<int>(begin.betas.size()) > body->NumShape()) {
    throw Error(
        "--betas",
        fmt::format("{} numbers, {} has {}", begin.betas.size(), body->Name(), body->NumShape()),
        "Give fewer");
  }
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(body->NumShape());
  std::ranges::copy(begin.betas, betas.begin());
  HeldStart start;
  start.mirrored = begin.left;
  start.actor = std::make_unique<const ActionActor>(body, betas);
  const std::string_view action = imos::Actions()[intent.action].label;
  start.prop = std::make_unique<const ActionProp>(
      MakeActionProp(object.name, object.mesh, ForFitting(object, kPairVertices, nullptr),
                     begin.left, NumThreads(common)));
  const ActionProp& prop = *start.prop;
  const ActionObject shape{prop.mesh, prop.surface, *prop.fit.distance};
  GraspStatus status{};
  std::vector<Grasp> grasps = FindActionGrasps(start.actor->Hand(Side::kRight), shape, common.seed,
                                               kGrasps, &status, NumThreads(common));
  if (grasps.empty()) {
    throw FitFailure(
        fmt::format("{}: {}. Try another size (--object-scale)", begin.object, Describe(status)));
  }
  std::vector<GraspPair> pairs;
  if (action == "offhand") {
    pairs = FindGraspPairs(start.actor->Hand(Side::kRight), start.actor->Hand(Side::kLeft), shape,
                           grasps, common.seed, kPairTries);
  }
  const ActionGrips grips(*start.actor, std::move(grasps), std::move(pairs));
  ActionClip made;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const std::uint64_t seed = MixSeed(common.seed, static_cast<std::uint64_t>(attempt));
    const StandingStart standing = OwnStanding(start.actor->Measures(), seed);
    made = MakeActionStart({action, *start.actor, *start.prop, grips, standing, false, seed},
                           begin.in_hand);
    if (made.fault.empty()) break;
  }
  if (!made.fault.empty()) {
    throw FitFailure(
        fmt::format("{}: nobody can hold it so as to '{}': {} ({}). Try another "
                    "--seed, --betas or --object-scale",
                    begin.object, action, made.fault, made.detail));
  }
  start.clip = std::move(made.clip);
  start.how = {{"made", true}, {"hand", begin.left ? "left" : "right"}, {"betas", begin.betas}};
  return start;
}

}  // namespace

HeldStart BeginSynthesis(const SynthesisBegin& begin, const imos::Intent& intent,
                         const CommonOptions& common) {
  const LoadedObject object = LoadObjectInput(begin.object, begin.object_scale);
  RequireHandheld(object);
  HeldStart start =
      begin.from.empty() ? Made(begin, intent, object, common) : FromClip(begin, common);
  if (!start.prop) {
    start.prop = std::make_unique<const ActionProp>(
        MakeActionProp(object.name, object.mesh, ForFitting(object, kPairVertices, nullptr),
                       start.mirrored, NumThreads(common)));
  }
  return start;
}

}  // namespace holdfast::apps
