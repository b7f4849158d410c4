// SPDX-License-Identifier: MIT
#include "solver/evaluation/synthesis/synthesis_case.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "generator/actions/action_strokes.h"
#include "generator/imos/action_sequence.h"
#include "generator/imos/run_synthesis.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/resample.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/fit.h"
#include "solver/handover/grasps_by_transfer.h"
#include "solver/synthesis/synthesis.h"

namespace holdfast {
namespace {

constexpr int kSimplified = 300;  // vertices, as published
constexpr double kFinishedRate_Hz = 30.0;
constexpr std::pair<ObjectMode, const char*> kModes[] = {{ObjectMode::kGiven, "given"},
                                                         {ObjectMode::kCarried, "carried"},
                                                         {ObjectMode::kFitted, "fitted"}};

using Clock = std::chrono::steady_clock;
double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

wandr::BodyKinematics<double> KinematicsOf(const imos::ActionSequence& sequence,
                                           const wandr::Pose<double>& pose) {
  wandr::BodyKinematics<double> kinematics;
  wandr::ForwardKinematics(wandr::BoneOffsetsOf(sequence.rest_joints), pose, kinematics);
  return kinematics;
}

// Of a clip's frame, in the clip's world.
wandr::BodyKinematics<double> KinematicsOf(const imos::ActionSequence& sequence, const Clip& clip,
                                           int frame) {
  wandr::Pose<double> pose;
  pose.translation = clip.trans.col(frame);
  for (int j = 0; j < kNumBodyJoints; ++j) pose.rotation[j] = ExpSO3(clip.pose[frame].col(j));
  return KinematicsOf(sequence, pose);
}

// The object of one case on its way through the key frames, canonical.
class ObjectOnItsWay {
 public:
  ObjectOnItsWay(const imos::ActionSequence& sequence, ObjectMode mode)
      : sequence_(sequence), mode_(mode) {
    constexpr int kLast = imos::kHistory - 1;
    object_ = True(kLast);
    body_ = KinematicsOf(sequence, sequence.BodyPose(kLast));
  }

  imos::ObjectPose Next(int frame, const wandr::Pose<double>& pose) {
    if (mode_ == ObjectMode::kGiven) return object_ = True(frame);
    const wandr::BodyKinematics<double> body = KinematicsOf(sequence_, pose);
    object_ = imos::Carried(object_, sequence_.carriers[frame], body_, body);
    body_ = body;
    return object_;
  }

 private:
  imos::ObjectPose True(int frame) const {
    return {sequence_.ObjectRotation(frame), sequence_.object_transl.col(frame)};
  }

  const imos::ActionSequence& sequence_;
  ObjectMode mode_;
  imos::ObjectPose object_;
  wandr::BodyKinematics<double> body_;
};

// Key frames in the world: fingers, jaw and eyes as in the last that was given, as published.
Clip KeysOf(const SynthesisCase& one, const imos::SynthesisTrack& track,
            const std::vector<imos::ObjectPose>& objects) {
  const imos::CanonicalFrame& canonical = one.sequence.canonical;
  Clip keys = one.keys;
  for (int k = imos::kHistory; k < keys.NumFrames(); ++k) {
    const wandr::Pose<double> pose = track.Pose(k);
    JointPose& to = keys.pose[k];
    to = keys.pose[k - 1];
    for (int j = 0; j < kNumBodyJoints; ++j) {
      const Eigen::Matrix3d R =
          j == 0 ? canonical.RotationToWorld(pose.rotation[0]) : pose.rotation[j];
      to.col(j) = UnwrapAxisAngle(LogSO3(R), keys.pose[k - 1].col(j));
    }
    keys.trans.col(k) = canonical.TranslToWorld(pose.translation);
    const imos::ObjectPose& object = objects[k - imos::kHistory];
    keys.object->trans.col(k) = canonical.PointToWorld(object.T);
    keys.object->orient.col(k) = UnwrapAxisAngle(LogSO3(canonical.RotationToWorld(object.R)),
                                                 keys.object->orient.col(k - 1));
  }
  return keys;
}

// Networks alone, some or all cases at once.
std::vector<SynthesizedCase> Follow(const RatedNetwork& network,
                                    std::span<const SynthesisCase> cases,
                                    const SynthesisOrder& order) {
  const imos::ObjectRotation rotation = network.network.Options().object_rotation;
  std::vector<imos::SynthesisStart> starts;
  std::vector<Eigen::Matrix3Xd> roots;
  std::vector<ObjectOnItsWay> objects;
  std::vector<std::vector<imos::ObjectPose>> found(cases.size());
  for (const SynthesisCase& one : cases) {
    starts.push_back(imos::StartOf(one.sequence, rotation, network.loaded.action_table));
    roots.push_back(one.sequence.transl);
    objects.emplace_back(one.sequence, order.mode);
  }
  imos::SynthesisRequest request;
  request.starts = starts;
  request.num_frames = imos::kNumKeyFrames;
  request.seed = order.seed;
  request.first_stream =
      static_cast<std::uint64_t>(order.repeat) * static_cast<std::uint64_t>(order.total) +
      static_cast<std::uint64_t>(order.first);
  request.sigma = order.sigma;
  request.roots = roots;  // not looked at by networks that make their own
  const std::vector<imos::SynthesisTrack> tracks = imos::RunSynthesis(
      network.network, request,
      [&](int sample, int frame, const wandr::Pose<double>& pose) {
        const imos::ObjectPose now = objects[sample].Next(frame, pose);
        found[sample].push_back(now);
        return imos::ObjectColumn(now.R, now.T, rotation);
      },
      order.threads);
  std::vector<SynthesizedCase> made(cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i)
    made[i].keys = KeysOf(cases[i], tracks[i], found[i]);
  return made;
}

// Key frames as the motion that 'synthesize' makes of them: all frames, with the strokes that key
// frames stand too far apart for. The object is where the hand carries it.
Clip InMotion(const SynthesisCase& one, const Clip& keys, const LoadedObject& object,
              std::uint64_t seed) {
  Clip motion = MotionOfKeyFrames(keys, MeasureBody(*one.scene.body, one.scene.betas),
                                  kFinishedRate_Hz, seed);
  ObjectMarks marks = MarksOf(object.name, object.mesh);
  const bool left = keys.holding_hand[imos::kHistory - 1] == kHoldsLeft;
  const Eigen::Vector3d root = one.sequence.rest_joints.col(0);
  if (left) {
    motion = MirrorClip(motion, root);
    marks = ReflectX(marks);
  }
  AddStrokes(one.sequence.rest_joints, imos::Actions()[one.sequence.action].label, marks, seed,
             motion.NumFrames(), motion);
  return left ? MirrorClip(motion, root) : motion;
}

// The frames of a motion at the times of key frames; those that were given stay.
Clip KeyFramesIn(const Clip& motion, const Clip& keys) {
  const Clip in_motion = Resample(motion, keys.frame_rate);
  Clip result = keys;
  const int count = std::min(keys.NumFrames(), in_motion.NumFrames());
  for (int k = imos::kHistory; k < count; ++k) {
    result.pose[k] = in_motion.pose[k];
    result.trans.col(k) = in_motion.trans.col(k);
    result.object->trans.col(k) = in_motion.object->trans.col(k);
    result.object->orient.col(k) = in_motion.object->orient.col(k);
  }
  return result;
}

// The loop with the fit, as 'synthesize' runs it.
SynthesizedCase Fit(const RatedNetwork& network, const SynthesisCase& one, int index,
                    const SynthesisOrder& order, FitLibrary& library) {
  const std::shared_ptr<const PreparedObject> object =
      library.Object(one.scene.object_source, 1.0, kSimplified, 1);
  const HandModel right(one.scene.body, one.scene.betas, Side::kRight);
  const HandModel left(one.scene.body, one.scene.betas, Side::kLeft);
  const bool offhand = imos::Actions()[one.sequence.action].label == "offhand";
  std::uint8_t bits = 0;
  for (const std::uint8_t hand : one.keys.holding_hand) bits |= hand;
  if (offhand) bits = kHoldsRight | kHoldsLeft;
  std::vector<const HandModel*> hands;
  if ((bits & kHoldsRight) != 0) hands.push_back(&right);
  if ((bits & kHoldsLeft) != 0) hands.push_back(&left);

  SynthesisScene scene{.start = Slice(one.keys, 0, imos::kHistory),
                       .rest_joints = one.sequence.rest_joints,
                       .hands = hands,
                       .object = object->fit,
                       .intent = {one.sequence.action, one.sequence.object},
                       .seconds_per_key_frame = one.sequence.seconds_per_key_frame,
                       .key_frames = imos::kNumKeyFrames,
                       .changes_hands = offhand};
  const FitOptions options;
  SynthesizedCase made;
  auto begin = Clock::now();
  made.keys =
      Synthesize(
          network.network, network.loaded.action_table, scene, options, 1, order.seed,
          static_cast<std::uint64_t>(order.repeat) * static_cast<std::uint64_t>(order.total) +
              static_cast<std::uint64_t>(index),
          order.sigma, 1)[0]
          .clip;
  made.seconds = SecondsSince(begin);
  begin = Clock::now();
  const Clip motion =
      InMotion(one, made.keys, object->object, order.seed + static_cast<std::uint64_t>(index));
  made.keys = KeyFramesIn(motion, made.keys);
  const auto of_these = static_cast<std::size_t>(index - order.first);
  if (of_these >= order.finish.size() || !order.finish[of_these]) return made;
  GraspTransferOptions transfer;
  transfer.seed = order.seed;
  const GraspMaker first = GraspsFromClip(motion, hands);
  const GraspMaker later =
      offhand ? GraspsByTransfer(right, left, object->object.mesh, object->solid.distance,
                                 *object->fit.distance, transfer, nullptr)
              : first;
  made.finished = FitClip(motion, hands, object->fit, motion.holding_hand, options,
                          [&](const GraspRequest& request) {
                            return request.frame == 0 ? first(request) : later(request);
                          })
                      .clip;
  made.finishing_seconds = SecondsSince(begin);
  return made;
}

}  // namespace

std::string ObjectModeName(ObjectMode mode) {
  for (const auto& [known, name] : kModes) {
    if (known == mode) return name;
  }
  return "";
}

std::optional<SynthesisCase> SynthesisCaseOf(imos::ActionSequence sequence, ClipScene scene,
                                             imos::KeyFrameRule rule) {
  scene.object.reset();  // loaded again where it is measured: there are hundreds of cases
  Clip keys = imos::KeyFramesOf(scene.clip, rule);
  const std::vector<std::uint8_t>& hands = keys.holding_hand;
  if (hands.empty() || hands[imos::kHistory - 1] == 0) return std::nullopt;
  return SynthesisCase{std::move(sequence), std::move(scene), std::move(keys)};
}

std::vector<SynthesizedCase> SynthesizeCases(const RatedNetwork& network,
                                             std::span<const SynthesisCase> cases,
                                             const SynthesisOrder& order, FitLibrary& library) {
  const int count = static_cast<int>(cases.size());
  if (order.mode == ObjectMode::kFitted) {
    std::vector<SynthesizedCase> made(cases.size());
    ParallelFor(count, order.threads, [&](int i) {
      if (!order.stopped()) made[i] = Fit(network, cases[i], order.first + i, order, library);
    });
    return made;
  }
  if (!order.timed) return Follow(network, cases, order);
  std::vector<SynthesizedCase> made;
  for (int i = 0; i < count; ++i) {
    SynthesisOrder alone = order;
    alone.first = order.first + i;
    alone.threads = 1;
    const auto begin = Clock::now();
    made.push_back(std::move(Follow(network, cases.subspan(i, 1), alone)[0]));
    made.back().seconds = SecondsSince(begin);
  }
  return made;
}

Clip HeldStill(const SynthesisCase& one) {
  Clip keys = one.keys;
  constexpr int kLast = imos::kHistory - 1;
  for (int k = imos::kHistory; k < keys.NumFrames(); ++k) {
    keys.pose[k] = keys.pose[kLast];
    keys.trans.col(k) = keys.trans.col(kLast);
    keys.object->trans.col(k) = keys.object->trans.col(kLast);
    keys.object->orient.col(k) = keys.object->orient.col(kLast);
  }
  return keys;
}

imos::JointMotion JointsOf(const Clip& keys, const SynthesisCase& one) {
  imos::JointMotion joints(3 * imos::kMetricJoints, keys.NumFrames());
  for (int k = 0; k < keys.NumFrames(); ++k) {
    const wandr::BodyKinematics<double> body = KinematicsOf(one.sequence, keys, k);
    for (int j = 0; j < imos::kMetricJoints; ++j) {
      joints.col(k).segment<3>(3 * j) = one.sequence.canonical.PointFromWorld(body.joints.col(j));
    }
  }
  return joints;
}

Eigen::Matrix3Xd ObjectFromHead(const Clip& keys, const SynthesisCase& one) {
  Eigen::Matrix3Xd seen(3, keys.NumFrames());
  for (int k = 0; k < keys.NumFrames(); ++k) {
    const wandr::BodyKinematics<double> body = KinematicsOf(one.sequence, keys, k);
    seen.col(k) =
        body.world[kHead].transpose() * (keys.object->trans.col(k) - body.joints.col(kHead));
  }
  return seen;
}

}  // namespace holdfast
