// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesize.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "generator/actions/action_strokes.h"
#include "generator/matching/body_frame.h"
#include "geometry/clip/mirror_clip.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/seed.h"
#include "solver/actions/action_clip.h"
#include "solver/actions/action_measures.h"
#include "solver/synthesis/arm_ease.h"
#include "solver/synthesis/hand_pace.h"
#include "solver/synthesis/return_motion.h"
#include "solver/synthesis/standing_life.h"
#include "solver/synthesis/still_start.h"
#include "solver/synthesis/synthesis_motion.h"

namespace holdfast {
namespace {

// How far the right elbow is above 5 cm below its shoulder, decimetres, at most: nobody lifts it so
// to hold something light.
double ElbowLifted(const Eigen::Matrix3Xd& rest_joints, const Clip& clip) {
  double most = 0.0;
  for (const BodyFrame& frame : BodyFrames(clip, rest_joints)) {
    const BodyPlacement placed = Place(rest_joints, frame);
    most = std::max(most, placed.joints(2, kRightElbow) - placed.joints(2, kRightShoulder) + 0.05);
  }
  return most / 0.1;
}

double FaultsOf(const HoldingStart& start, const Clip& motion) {
  ActionQuality quality;
  MeasureAction(*start.actor, *start.prop, motion, quality);
  const auto share = [](double value, double most) { return std::max(0.0, value / most - 0.5); };
  return share(quality.penetrating, 0.02) + share(1.0 - quality.contact, 0.02) +
         share(quality.object_in_body_mm, 5.0) + share(quality.hand_in_head_mm, 6.0) +
         share(quality.arm_in_trunk_mm, 25.0) + share(quality.beyond_limits, 0.03) +
         share(quality.skate, 0.1) + ElbowLifted(start.actor->Measures().rest_joints, motion);
}

// Sample `number`: key frames as motion, with all that is drawn for it.
SynthesizedSample MotionOf(const HoldingStart& start, std::string_view action,
                           const SynthesizeOptions& options, Synthesised keys, int number) {
  const Eigen::Matrix3Xd& rest_joints = start.actor->Measures().rest_joints;
  const auto stream = static_cast<std::uint64_t>(number);
  SynthesizedSample sample;
  sample.keys = std::move(keys);
  sample.number = number;
  // The hand that takes over has its own way to go: left as it is.
  const bool passes_on = sample.keys.switch_frame >= 0;
  if (!passes_on) {
    sample.style = DrawSampleStyle(options.seed, number, options.style);
    if (options.keep_pace) sample.style.pace = 1.0;
    ApplySampleStyle(sample.style, rest_joints, sample.keys.clip);
  }
  sample.motion = MotionOfKeyFrames(sample.keys.clip, start.actor->Measures(), options.frame_rate,
                                    options.seed + stream);
  AddTakingPart(rest_joints, action, MixSeed(options.seed, 500 + stream), sample.motion);
  if (!passes_on) {
    // Elbows go down by more than up.
    EaseArm(*start.actor, *start.prop, action, std::min(sample.style.elbow, 6.0 * kDegree),
            sample.motion);
  }
  sample.faults = FaultsOf(start, sample.motion);
  return sample;
}

// So many of the best samples are brought to the face before one is taken: with some of them, head
// and arms are in each other's way then.
constexpr int kBroughtToFace = 3;

void BringToFace(const HoldingStart& start, std::string_view action, SynthesizedSample& sample) {
  constexpr double kOff_m = 0.015;  // at most
  const std::optional<FaceDistance> nearest =
      RefitAtFace(*start.actor, *start.prop, action, sample.motion);
  if (!nearest) return;
  sample.faults = FaultsOf(start, sample.motion) + nearest->distance_m / kOff_m;
}

// Whether the object stands on the table where the motion begins.
bool StandsOnTable(const HoldingStart& start) {
  constexpr double kOn_m = 0.01;
  if (!start.clip.table) return false;
  const Eigen::Index last = start.clip.NumFrames() - 1;
  const Eigen::Matrix3Xd placed = start.clip.object->Pose(last) * start.prop->mesh.vertices;
  return std::abs(placed.row(2).minCoeff() - start.clip.table->trans(2, last)) < kOn_m;
}

// What is left to do once a sample is taken.
void Finish(const HoldingStart& start, std::string_view action, const SynthesizeOptions& options,
            SynthesizedSample& sample) {
  const Eigen::Matrix3Xd& rest_joints = start.actor->Measures().rest_joints;
  if (!options.keep_pace) sample.hurried = LeaveOutStill(rest_joints, sample.motion);
  if (sample.keys.switch_frame >= 0) return;
  PaceHand(rest_joints, sample.motion);
  const int there = sample.motion.NumFrames();
  if (options.and_back) AddReturn(rest_joints, StandsOnTable(start), sample.motion);
  AddStrokes(rest_joints, action, start.prop->marks,
             MixSeed(options.seed, static_cast<std::uint64_t>(sample.number)), there,
             sample.motion);
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
  std::vector<Synthesised> made =
      Synthesise(imos::Network<float>(network),
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

}  // namespace holdfast
