// SPDX-License-Identifier: MIT
#include "solver/synthesis/action_case.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "generator/actions/action_strokes.h"
#include "generator/imos/action_sequence.h"
#include "generator/imos/synthesis_network.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/resample.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/fit.h"
#include "solver/handover/grasps_by_transfer.h"
#include "solver/synthesis/synthesis.h"

namespace holdfast {
namespace {

constexpr int kSimplified = 300;  // vertices, as published
constexpr double kFinishedRate_Hz = 30.0;

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

// Kinematics of a frame of a clip, in the clip's world.
wandr::BodyKinematics<double> KinematicsOf(const imos::ActionSequence& sequence, const Clip& clip,
                                           int frame) {
  wandr::Pose<double> pose;
  pose.translation = clip.trans.col(frame);
  for (int j = 0; j < kNumBodyJoints; ++j) pose.rotation[j] = ExpSO3(clip.pose[frame].col(j));
  return KinematicsOf(sequence, pose);
}

// Key frames in the world: fingers, jaw and eyes copied from the last given one, as published.
Clip KeysOf(const ActionCase& one, const imos::SynthesisTrack& track,
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

// Runs the networks without the fit.
MadeCase Follow(const CaseNetwork& network, const ActionCase& one, const CaseOptions& options) {
  const imos::ObjectRotation rotation = network.network.Options().object_rotation;
  const std::vector<imos::SynthesisStart> starts = {
      imos::StartOf(one.sequence, rotation, network.loaded.action_table)};
  const std::vector<Eigen::Matrix3Xd> roots = {one.sequence.transl};
  // The object over the key frames, canonical frame.
  const auto true_object = [&](int frame) -> imos::ObjectPose {
    return {one.sequence.ObjectRotation(frame), one.sequence.object_transl.col(frame)};
  };
  constexpr int kLast = imos::kHistory - 1;
  imos::ObjectPose object = true_object(kLast);
  wandr::BodyKinematics<double> body = KinematicsOf(one.sequence, one.sequence.BodyPose(kLast));
  std::vector<imos::ObjectPose> found;
  imos::SynthesisRequest request;
  request.starts = starts;
  request.num_frames = imos::kNumKeyFrames;
  request.seed = options.seed;
  request.first_stream = options.stream;
  request.sigma = options.sigma;
  request.roots = roots;  // ignored by networks that generate the root
  MadeCase made;
  const auto begin = Clock::now();
  const std::vector<imos::SynthesisTrack> tracks = imos::RunSynthesis(
      network.network, request,
      [&](int, int frame, const wandr::Pose<double>& pose) {
        if (options.mode == ObjectMode::kGiven) {
          object = true_object(frame);
        } else {
          const wandr::BodyKinematics<double> now = KinematicsOf(one.sequence, pose);
          object = imos::Carried(object, one.sequence.carriers[frame], body, now);
          body = now;
        }
        found.push_back(object);
        return imos::ObjectColumn(object.R, object.T, rotation);
      },
      1);
  made.keys = KeysOf(one, tracks[0], found);
  made.seconds = SecondsSince(begin);
  return made;
}

// Converts key frames to motion as 'synthesize' does: all frames, plus strokes too fast for key
// frames. The object moves with the hand.
Clip InMotion(const ActionCase& one, const Clip& keys, const LoadedObject& object,
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

// Samples a motion at the times of the key frames; the given key frames are kept.
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

// Runs the loop with the fit, as 'synthesize' does.
MadeCase Fit(const CaseNetwork& network, const ActionCase& one, const CaseOptions& order,
             FitLibrary& library) {
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
  MadeCase made;
  auto begin = Clock::now();
  made.keys = Synthesize(network.network, network.loaded.action_table, scene, options, 1,
                         order.seed, order.stream, order.sigma, 1)[0]
                  .clip;
  made.seconds = SecondsSince(begin);
  begin = Clock::now();
  const Clip motion = InMotion(one, made.keys, object->object, order.stroke_seed);
  made.keys = KeyFramesIn(motion, made.keys);
  if (!order.finish) return made;
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

MadeCase MakeCase(const CaseNetwork& network, const ActionCase& one, const CaseOptions& options,
                  FitLibrary& library) {
  return options.mode == ObjectMode::kFitted ? Fit(network, one, options, library)
                                             : Follow(network, one, options);
}

Eigen::MatrixXd JointsOf(const Clip& keys, const ActionCase& one) {
  Eigen::MatrixXd joints(3 * kNumBodyJoints, keys.NumFrames());
  for (int k = 0; k < keys.NumFrames(); ++k) {
    const wandr::BodyKinematics<double> body = KinematicsOf(one.sequence, keys, k);
    for (int j = 0; j < kNumBodyJoints; ++j) {
      joints.col(k).segment<3>(3 * j) = one.sequence.canonical.PointFromWorld(body.joints.col(j));
    }
  }
  return joints;
}

Eigen::Matrix3Xd ObjectFromHead(const Clip& keys, const ActionCase& one) {
  Eigen::Matrix3Xd seen(3, keys.NumFrames());
  for (int k = 0; k < keys.NumFrames(); ++k) {
    const wandr::BodyKinematics<double> body = KinematicsOf(one.sequence, keys, k);
    seen.col(k) =
        body.world[kHead].transpose() * (keys.object->trans.col(k) - body.joints.col(kHead));
  }
  return seen;
}

}  // namespace holdfast
