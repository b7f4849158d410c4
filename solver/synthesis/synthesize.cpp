// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesize.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "generator/actions/action_catalog.h"
#include "generator/actions/action_strokes.h"
#include "generator/imos/config.h"
#include "generator/matching/body_frame.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/seed.h"
#include "solver/actions/action_clip.h"
#include "solver/actions/action_measures.h"
#include "solver/synthesis/motion_passes.h"
#include "solver/synthesis/standing_life.h"
#include "solver/synthesis/synthesis.h"
#include "solver/take/take_table.h"

namespace holdfast {
namespace {

constexpr std::uint64_t kStanding = 0x3E1;  // random stream

// Maximum height of the right elbow above 5 cm below its shoulder, in decimeters: nobody lifts it
// like that to hold a light object.
double ElbowLifted(const Eigen::Matrix3Xd& rest_joints, const Clip& clip) {
  double most = 0.0;
  for (const BodyFrame& frame : BodyFrames(clip, rest_joints)) {
    const BodyPlacement placed = Place(rest_joints, frame);
    most = std::max(most, placed.joints(2, kRightElbow) - placed.joints(2, kRightShoulder) + 0.05);
  }
  return most / 0.1;
}

// Of a motion, in which both hands follow the object if both hold.
double FaultsOf(const HoldingStart& start, Clip& motion) {
  constexpr double kOff_m = 0.01;
  double out_of_reach = 0.0;
  if (start.both) {
    out_of_reach =
        FollowWithBothHands(start.actor->Measures().rest_joints, *start.both, motion) / kOff_m;
  }
  ActionQuality quality;
  MeasureAction(*start.actor, *start.prop, motion, quality);
  const auto share = [](double value, double most) { return std::max(0.0, value / most - 0.5); };
  return share(quality.penetrating, 0.02) + share(1.0 - quality.contact, 0.02) +
         share(quality.object_in_body_mm, 5.0) + share(quality.hand_in_head_mm, 6.0) +
         share(quality.arm_in_trunk_mm, 25.0) + share(quality.beyond_limits, 0.03) +
         share(quality.skate, 0.1) + ElbowLifted(start.actor->Measures().rest_joints, motion) +
         out_of_reach;
}

// Converts the key frames of sample `number` to motion, with its random style.
SynthesizedSample MotionOf(const HoldingStart& start, std::string_view action,
                           const SynthesizeOptions& options, Synthesized keys, int number) {
  const Eigen::Matrix3Xd& rest_joints = start.actor->Measures().rest_joints;
  const auto stream = static_cast<std::uint64_t>(number);
  SynthesizedSample sample;
  sample.keys = std::move(keys);
  sample.number = number;
  // In a handover the receiving hand has its own path: unchanged.
  const bool passes_on = sample.keys.switch_frame >= 0;
  if (!passes_on) {
    sample.style = DrawSampleStyle(options.seed, number, options.style);
    if (options.keep_pace) sample.style.pace = 1.0;
    ApplySampleStyle(sample.style, rest_joints, sample.keys.clip);
  }
  sample.motion = MotionOfKeyFrames(sample.keys.clip, start.actor->Measures(), options.frame_rate,
                                    options.seed + stream);
  AddSecondaryMotion(rest_joints, action, MixSeed(options.seed, 500 + stream), sample.motion);
  if (!passes_on) {
    // Elbows are lowered more than raised.
    EaseArm(*start.actor, *start.prop, start.opening, action,
            std::min(sample.style.elbow, 6.0 * kDegree), sample.motion);
  }
  if (start.both) TakeInBothHands(rest_joints, *start.both, sample.motion);
  sample.faults = FaultsOf(start, sample.motion);
  return sample;
}

// Number of best samples that are moved to the face before selection: in some of them, head and
// arms then collide.
constexpr int kBroughtToFace = 3;

void BringToFace(const HoldingStart& start, std::string_view action, SynthesizedSample& sample) {
  constexpr double kOff_m = 0.015;  // at most
  const std::optional<FaceDistance> nearest =
      RefitAtFace(*start.actor, *start.prop, action, sample.motion);
  if (!nearest) return;
  sample.faults = FaultsOf(start, sample.motion) + nearest->distance_m / kOff_m;
}

// Whether the object stands on the table at the start of the motion.
bool StandsOnTable(const HoldingStart& start) {
  constexpr double kOn_m = 0.01;
  if (!start.clip.table) return false;
  const Eigen::Index last = start.clip.NumFrames() - 1;
  const Eigen::Matrix3Xd placed = start.clip.object->Pose(last) * start.prop->mesh.vertices;
  return std::abs(placed.row(2).minCoeff() - start.clip.table->trans(2, last)) < kOn_m;
}

// Remaining steps for a selected sample.
void Finish(const HoldingStart& start, std::string_view action, const SynthesizeOptions& options,
            SynthesizedSample& sample) {
  const Eigen::Matrix3Xd& rest_joints = start.actor->Measures().rest_joints;
  if (!options.keep_pace) sample.hurried = TrimIdle(rest_joints, sample.motion);
  const std::uint64_t seed = MixSeed(options.seed, static_cast<std::uint64_t>(sample.number));
  if (sample.keys.switch_frame >= 0) {
    if (options.and_back) AddRest(rest_joints, seed, sample.motion);
    AddStandingMotion(rest_joints, action, false, false, MixSeed(seed, kStanding), sample.motion);
    return;
  }
  RetimeHand(rest_joints, sample.motion);
  const int there = sample.motion.NumFrames();
  if (options.and_back) AddReturn(rest_joints, StandsOnTable(start), seed, sample.motion);
  AddStrokes(rest_joints, action, start.prop->marks, seed, there, sample.motion);
  AddStandingMotion(rest_joints, action, !start.both, start.clip.table.has_value(),
                    MixSeed(seed, kStanding), sample.motion);
  if (start.both) {
    FollowWithBothHands(rest_joints, *start.both, sample.motion);
  } else if (StandsOnTable(start)) {
    StayAboveTable(rest_joints, start.prop->mesh, start.clip.table->trans(2, 0), sample.motion);
  }
}

}  // namespace

std::optional<FaceDistance> NearestToFace(const HoldingStart& start, std::string_view action,
                                          const Clip& clip) {
  const Eigen::Vector3d root = start.actor->Measures().rest_joints.col(0);
  return NearestToFace(*start.actor, *start.prop, action,
                       start.mirrored ? MirrorClip(clip, root) : clip);
}

SynthesizedMotion Synthesize(const HoldingStart& start, const imos::NetworkWeights& network,
                             const imos::Intent& intent, const SynthesizeOptions& options,
                             const StagedProgress& progress) {
  const HandModel* const hands[] = {&start.actor->Hand(Side::kRight),
                                    &start.actor->Hand(Side::kLeft)};
  const std::string action(imos::Actions()[intent.action].label);
  if (start.both && action == "offhand") {
    throw Error("hand", "both hands hold the object: neither is free to take it over",
                "Give one hand");
  }
  const SynthesisScene scene{start.clip,
                             start.actor->Measures().rest_joints,
                             hands,
                             start.prop->fit,
                             intent,
                             options.seconds_per_key_frame,
                             options.key_frames,
                             action == "offhand"};
  SynthesizedMotion result;
  const auto began = std::chrono::steady_clock::now();
  std::vector<Synthesized> made =
      Synthesize(imos::Network<float>(network),
                 options.action_table ? *options.action_table : imos::ActionTable(network), scene,
                 FitOptions(), options.samples, options.seed, 0, options.sigma, options.threads);
  result.loop_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  result.samples.resize(made.size());
  ParallelFor(static_cast<int>(made.size()), options.threads, [&](int i) {
    result.samples[i] = MotionOf(start, action, options, std::move(made[i]), i);
  });
  std::ranges::stable_sort(result.samples, {}, &SynthesizedSample::faults);
  result.stopped = progress && !progress("synthesize", 1, 1);
  const int all = static_cast<int>(result.samples.size());
  const int brought = options.finish_all ? all : std::min(all, kBroughtToFace);
  if (result.samples.front().keys.switch_frame < 0) {
    ParallelFor(brought, options.threads,
                [&](int i) { BringToFace(start, action, result.samples[i]); });
    std::ranges::stable_sort(result.samples.begin(), result.samples.begin() + brought, {},
                             &SynthesizedSample::faults);
  }
  SynthesizedSample& best = result.samples.front();
  result.lets_go = best.keys.switch_frame < 0 && options.and_back && StandsOnTable(start);
  const int finished = options.finish_all ? all : 1;
  ParallelFor(finished, options.threads,
              [&](int i) { Finish(start, action, options, result.samples[i]); });
  if (StandsOnTable(start)) {
    AddTable(std::array{0}, start.actor->Skin(), start.prop->mesh, options.threads, best.motion);
  }
  result.motion = start.mirrored ? MirrorClip(best.motion, scene.rest_joints.col(0)) : best.motion;
  result.motion.action = action;
  result.first_hand = start.mirrored ? Side::kLeft : Side::kRight;
  if (best.keys.switch_frame >= 0) {
    result.switch_frame =
        static_cast<int>(std::lround((best.keys.switch_frame - 0.5) *
                                     options.seconds_per_key_frame * options.frame_rate)) -
        best.hurried;
  }
  return result;
}

OptionTable OptionsOf(SynthesisJob& job) {
  SynthesizeOptions& options = job.options;
  OptionTable table;
  table.Text(
      "object_class", job.object_class,
      "Class of the object for the networks: mug, waterbottle, ...; empty: the object's name");
  table.Number("object_scale", "", job.object_scale, kPositive,
               "Multiplies the object's coordinates (0.001 for millimeters)");
  table.Choice<std::optional<bool>>(
      "start", job.standing.in_hand, {{"any", std::nullopt}, {"table", false}, {"hand", true}},
      "Place of the object in the start pose, if no clip gives it: table, hand, or any");
  table.Choice(
      "hand", job.standing.hands,
      {{"right", GraspHands::kRight}, {"left", GraspHands::kLeft}, {"both", GraspHands::kBoth}},
      "Hand that holds the object in the start pose, if no clip gives it; both: the object is "
      "between the hands");
  table.Number("seconds", "", job.seconds, {0.5, 60.0}, "typical of the action",
               "Duration of the motion before the object is put back, seconds");
  table.Number("key_frames", "", options.key_frames, {imos::kHistory + 1, 1000},
               "Number of key frames, including the 4 of the start");
  table.Number("samples", "", options.samples, {1, 10'000},
               "Number of motions to sample; the best is kept");
  table.Number("sigma", "", options.sigma, {0.0, 3.0},
               "Standard deviation of the latents; 0: the mean motion");
  table.Number("style", "", options.style, {0.0, 2.0},
               "Variation of pace and posture between samples; 0: samples differ only in their "
               "latents. Not applied to the first sample");
  table.Number("frame_rate", "", options.frame_rate, {5.0, 240.0}, "Frame rate of the output, Hz");
  table.Flag("and_back", options.and_back,
             "Return to rest at the end (object back in its place, and released if that is on a "
             "table)");
  return table;
}

std::vector<std::string> OfferedActions(const SynthesisNetwork& network, bool makes_start) {
  std::vector<std::string> offered = network.Actions();
  std::erase_if(offered, [&](const std::string& action) {
    return makes_start && std::ranges::find(ScriptedActions(), action, &ScriptedAction::name) ==
                              ScriptedActions().end();
  });
  return offered;
}

void RequireOffered(const imos::Intent& intent, const std::vector<std::string>& offered,
                    const std::string& where) {
  const std::string_view label = imos::Actions()[intent.action].label;
  if (std::ranges::find(offered, label) != offered.end()) return;
  const std::optional<int> similar = imos::SimilarAction(intent.action, offered);
  throw Error(
      where,
      fmt::format("no motion can be generated for '{}': the networks' training data have none",
                  label),
      fmt::format("{}Choose one of: {}",
                  similar
                      ? fmt::format("The nearest action is '{}'. ", imos::Actions()[*similar].label)
                      : std::string(),
                  fmt::join(offered, ", ")));
}

std::optional<std::string> NoteOnIntent(const SynthesisNetwork& network,
                                        const imos::Intent& intent) {
  const std::string object(imos::Objects()[intent.object]);
  const auto seen = network.seen.find(std::string(imos::Actions()[intent.action].label));
  if (seen == network.seen.end() || !seen->second.is_object() || seen->second.contains(object)) {
    return std::nullopt;
  }
  std::vector<std::string> objects;
  for (const auto& [name, count] : seen->second.items()) objects.push_back(name);
  return fmt::format("the training data have no clip of a person who {} a {}, only with: {}",
                     imos::Actions()[intent.action].verb, object, fmt::join(objects, ", "));
}

HoldingStart MakeStart(const ClipBody& body, const LoadedObject& object, const std::string& name,
                       std::string_view action, const StandingHoldOptions& options) {
  StandingHold hold = MakeStandingHold(body, object, action, options);
  if (!hold.graspable) {
    throw FitFailure(
        fmt::format("{}: {}. Try another size (--object-scale)", name, Describe(hold.grasp)));
  }
  if (!hold.fault.empty()) {
    throw FitFailure(
        fmt::format("{}: it cannot be held for the action '{}': {} ({}). Try another --seed, "
                    "--betas or --object-scale",
                    name, action, hold.fault, hold.detail));
  }
  return std::move(hold.start);
}

SynthesizedMotion Synthesize(SynthesisJob& job, const HoldingStart& start,
                             const SynthesisNetwork& network, const imos::Intent& intent,
                             const StagedProgress& progress) {
  SynthesizeOptions& options = job.options;
  options.seconds_per_key_frame = job.seconds ? *job.seconds / (options.key_frames - 1)
                                              : network.SecondsPerKeyFrame(intent.action);
  options.keep_pace = job.seconds.has_value();
  options.action_table = network.action_table;
  return Synthesize(start, network.weights, intent, options, progress);
}

FitJob FitOf(const SynthesisJob& job, const SynthesizedMotion& made, const std::string& object) {
  FitJob fit;
  fit.clip = made.motion.action;
  fit.object = object;
  CarryOptions& carry = fit.carry;
  carry.object_scale = job.object_scale;
  carry.clear_passages = made.lets_go;
  carry.hand_over = made.switch_frame.has_value();
  if (carry.hand_over) {
    carry.handover.switch_frames = {*made.switch_frame};
    carry.handover.first_hand = made.first_hand;
  }
  carry.seed = job.options.seed;
  carry.threads = job.options.threads;
  return fit;
}

}  // namespace holdfast
