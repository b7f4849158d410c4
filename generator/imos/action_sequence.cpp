// SPDX-License-Identifier: MIT
#include "generator/imos/action_sequence.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "generator/imos/vocabulary.h"
#include "generator/wandr/intention.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast::imos {
namespace {

using wandr::BodyKinematics;
using wandr::RotationFromRows12;
using wandr::Rows12;

constexpr double kMetersPerRadian = 0.1;  // weight of rotation against translation of a held object

ObjectPose ObjectAt(const ActionSequence& sequence, int key_frame) {
  return {sequence.ObjectRotation(key_frame), sequence.object_transl.col(key_frame)};
}

// Computes joints and carriers from the poses.
void Complete(ActionSequence& sequence) {
  const int frames = sequence.NumKeyFrames();
  const wandr::BoneOffsets<double> bones = wandr::BoneOffsetsOf(sequence.rest_joints);
  std::vector<BodyKinematics<double>> kinematics(frames);
  sequence.joints.resize(wandr::kJointNumbers, frames);
  sequence.carriers.assign(frames, Carrier::kNothing);
  for (int k = 0; k < frames; ++k) {
    ForwardKinematics(bones, sequence.BodyPose(k), kinematics[k]);
    Eigen::Map<wandr::BodyJoints<double>>(sequence.joints.col(k).data()) = kinematics[k].joints;
    if (k == 0) continue;
    const ObjectPose truth = ObjectAt(sequence, k);
    // Hands at both ends count, since a hand may take or release the object between key frames.
    const std::uint8_t hands = sequence.hands[k - 1] | sequence.hands[k];
    double least = std::numeric_limits<double>::infinity();
    for (const Carrier carrier : {Carrier::kNothing, Carrier::kRightWrist, Carrier::kLeftWrist}) {
      const std::uint8_t bit = carrier == Carrier::kRightWrist ? kHoldsRight : kHoldsLeft;
      if (carrier != Carrier::kNothing && hands != 0 && (hands & bit) == 0) continue;
      const ObjectPose guess =
          Carried(ObjectAt(sequence, k - 1), carrier, kinematics[k - 1], kinematics[k]);
      const double error =
          (guess.T - truth.T).norm() + kMetersPerRadian * AngleBetween(guess.R, truth.R);
      if (error >= least) continue;
      least = error;
      sequence.carriers[k] = carrier;
    }
  }
  if (frames > 1) sequence.carriers[0] = sequence.carriers[1];
}

}  // namespace

CanonicalFrame CanonicalFrameOf(const Eigen::Matrix3d& root, const Eigen::Vector3d& transl,
                                const Eigen::Vector3d& rest_pelvis) {
  CanonicalFrame frame;
  frame.rest_pelvis = rest_pelvis;
  frame.pelvis = transl + rest_pelvis;
  const wandr::Heading<double> heading = wandr::HeadingOf<double>(root);
  frame.turn << heading.cosine, heading.sine, 0.0, -heading.sine, heading.cosine, 0.0, 0.0, 0.0,
      1.0;
  return frame;
}

Eigen::Matrix3d ActionSequence::Rotation(int joint, int key_frame) const {
  return RotationFromRows12<double>(pose.col(key_frame).segment<6>(6 * joint));
}

Eigen::Matrix3d ActionSequence::ObjectRotation(int key_frame) const {
  return RotationFromRows12<double>(object_rotation.col(key_frame));
}

wandr::Pose<double> ActionSequence::BodyPose(int key_frame) const {
  wandr::Pose<double> body;
  body.translation = transl.col(key_frame);
  for (int j = 0; j < kNumBodyJoints; ++j) body.rotation[j] = Rotation(j, key_frame);
  return body;
}

ObjectPose Carried(const ObjectPose& object, Carrier carrier, const BodyKinematics<double>& from,
                   const BodyKinematics<double>& to) {
  if (carrier == Carrier::kNothing) return object;
  const int wrist = WristJoint(carrier == Carrier::kRightWrist ? Side::kRight : Side::kLeft);
  const Eigen::Matrix3d turn = to.world[wrist] * from.world[wrist].transpose();
  return {wandr::Orthonormalized<double>(turn * object.R),
          turn * (object.T - from.joints.col(wrist)) + to.joints.col(wrist)};
}

ActionSequence SequenceFromClip(const Clip& clip,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& rest_joints,
                                KeyFrameRule rule) {
  if (!clip.object) {
    throw Error("clip", "it has no object", "Give clips of a person using an object");
  }
  if (rest_joints.cols() != kNumJoints) {
    throw Error("clip", "it contains only a hand", "Give clips of a whole body");
  }
  ActionSequence out;
  out.action = ActionId(clip.action, "action");
  out.object = ObjectId(clip.object->name, "object");
  const Clip keys = KeyFramesOf(clip, rule);
  const int frames = keys.NumFrames();
  out.subject = clip.subject;
  out.gender = clip.gender;
  out.seconds_per_key_frame = 1.0 / keys.frame_rate;
  const Eigen::Index betas = std::min<Eigen::Index>(clip.betas.size(), kNumBetas);
  out.betas.head(betas) = clip.betas.head(betas);
  out.rest_joints = rest_joints;
  out.canonical =
      CanonicalFrameOf(ExpSO3(keys.pose[0].col(0)), keys.trans.col(0), rest_joints.col(0));
  out.pose.resize(kPoseNumbers, frames);
  out.transl.resize(3, frames);
  out.object_transl.resize(3, frames);
  out.object_rotation.resize(6, frames);
  for (int k = 0; k < frames; ++k) {
    for (int j = 0; j < kNumJoints; ++j) {
      const Eigen::Matrix3d R = ExpSO3(keys.pose[k].col(j));
      out.pose.col(k).segment<6>(6 * j) =
          Rows12<double>(j == 0 ? out.canonical.RotationFromWorld(R) : R);
    }
    out.transl.col(k) = out.canonical.TranslFromWorld(keys.trans.col(k));
    out.object_transl.col(k) = out.canonical.PointFromWorld(keys.object->trans.col(k));
    out.object_rotation.col(k) =
        Rows12<double>(out.canonical.RotationFromWorld(ExpSO3(keys.object->orient.col(k))));
  }
  out.hands = keys.holding_hand;
  if (out.hands.empty()) out.hands.assign(frames, 0);
  Complete(out);
  return out;
}

ActionSequence SequenceFromClip(const Clip& clip, const std::shared_ptr<const BodyModel>& body,
                                KeyFrameRule rule) {
  if (clip.v_template.cols() == body->NumVertices()) {
    return SequenceFromClip(clip, body->RestJoints(clip.v_template), rule);
  }
  Clip shaped = clip;
  // Betas of another model's shape space are not valid here.
  if (!clip.body_model.empty() && clip.body_model != body->Name()) shaped.betas.resize(0);
  const Eigen::Index used = std::min<Eigen::Index>(shaped.betas.size(), body->NumShape());
  return SequenceFromClip(shaped, body->RestJoints(body->ShapedVertices(shaped.betas.head(used))),
                          rule);
}

ActionSequence Mirrored(const ActionSequence& sequence) {
  const Eigen::DiagonalMatrix<double, 3> mirror(-1.0, 1.0, 1.0);
  ActionSequence out = sequence;
  out.mirrored = !sequence.mirrored;
  const auto reflected = [&](const Eigen::Matrix3d& R) -> Eigen::Matrix3d {
    return mirror * R * mirror;
  };
  for (int j = 0; j < kNumJoints; ++j) {
    out.rest_joints.col(j) = mirror * sequence.rest_joints.col(MirrorJoint(j));
  }
  for (int k = 0; k < sequence.NumKeyFrames(); ++k) {
    for (int j = 0; j < kNumJoints; ++j) {
      out.pose.col(k).segment<6>(6 * j) =
          Rows12<double>(reflected(sequence.Rotation(MirrorJoint(j), k)));
    }
    out.transl.col(k) =
        mirror * (sequence.transl.col(k) + sequence.rest_joints.col(0)) - out.rest_joints.col(0);
    out.object_transl.col(k) = mirror * sequence.object_transl.col(k);
    out.object_rotation.col(k) = Rows12<double>(reflected(sequence.ObjectRotation(k)));
    const std::uint8_t held = sequence.hands[k];
    out.hands[k] = static_cast<std::uint8_t>(((held & kHoldsRight) ? kHoldsLeft : 0) |
                                             ((held & kHoldsLeft) ? kHoldsRight : 0));
  }
  // The mirror is in the canonical frame, so the transform back leads to the mirrored world.
  out.canonical.rest_pelvis = out.rest_joints.col(0);
  out.canonical.pelvis = mirror * sequence.canonical.pelvis;
  out.canonical.turn = reflected(sequence.canonical.turn);
  Complete(out);
  return out;
}

namespace {

constexpr int kPaperSteps = 20;  // number of steps over the contact in the published code

Clip Picked(const Clip& clip, int first, int step) {
  std::vector<int> frames(kNumKeyFrames);
  for (int k = 0; k < kNumKeyFrames; ++k) frames[k] = first + k * step;
  Clip out = clip;
  out.frame_rate = clip.frame_rate / step;
  out.trans = clip.trans(Eigen::all, frames);
  const auto pick_track = [&](const std::optional<ObjectTrack>& from,
                              std::optional<ObjectTrack>& to) {
    if (!from) return;
    to->trans = from->trans(Eigen::all, frames);
    to->orient = from->orient(Eigen::all, frames);
  };
  pick_track(clip.object, out.object);
  pick_track(clip.table, out.table);
  out.pose.clear();
  out.holding_hand.clear();
  for (const int frame : frames) {
    out.pose.push_back(clip.pose[frame]);
    if (!clip.holding_hand.empty()) out.holding_hand.push_back(clip.holding_hand[frame]);
  }
  if (clip.contact && clip.contact->object.size() > 0) {
    out.contact->object = clip.contact->object(Eigen::all, frames);
  }
  if (clip.contact && clip.contact->body.size() > 0) {
    out.contact->body = clip.contact->body(Eigen::all, frames);
  }
  return out;
}

// The first and last frame with object contact, from the clip's contact labels or else from
// `holding_hand`. Nullopt if there is no contact, or neither source.
std::optional<std::pair<int, int>> ContactInterval(const Clip& clip) {
  const bool labeled = clip.contact && clip.contact->object.size() > 0;
  if (!labeled && clip.holding_hand.empty()) return std::nullopt;
  std::optional<std::pair<int, int>> interval;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const bool touches =
        labeled ? (clip.contact->object.col(t).array() != 0).any() : clip.holding_hand[t] != 0;
    if (!touches) continue;
    if (!interval) interval.emplace(t, t);
    interval->second = t;
  }
  return interval;
}

}  // namespace

std::optional<std::string> LackOfKeyFrames(const Clip& clip, KeyFrameRule rule) {
  if (clip.NumFrames() < kNumKeyFrames) {
    return fmt::format("the clip has {} frames, {} are needed", clip.NumFrames(), kNumKeyFrames);
  }
  if (rule == KeyFrameRule::kWhole) return std::nullopt;
  const auto contact = ContactInterval(clip);
  if (!contact) return "no contact with the object is recorded";
  const int frames = contact->second - contact->first;
  if (frames >= kPaperSteps) return std::nullopt;
  return fmt::format("the object is touched for {} frames, more than {} are needed", frames + 1,
                     kPaperSteps);
}

Clip KeyFramesOf(const Clip& clip, KeyFrameRule rule) {
  if (const auto lack = LackOfKeyFrames(clip, rule)) {
    throw Error("key frames", *lack,
                rule == KeyFrameRule::kPaper ? "Give clips with contact, or use whole clips"
                                             : "Give longer clips");
  }
  if (rule == KeyFrameRule::kWhole) {
    const double step = static_cast<double>(clip.NumFrames() - 1) / (kNumKeyFrames - 1);
    return Resample(clip, clip.frame_rate / step);
  }
  const auto [first, last] = *ContactInterval(clip);
  return Picked(clip, first, (last - first) / kPaperSteps);
}

}  // namespace holdfast::imos
