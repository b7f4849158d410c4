// SPDX-License-Identifier: MIT
#include "solver/actions/action_clip.h"

#include <algorithm>
#include <tuple>

#include "generator/actions/action_strokes.h"
#include "generator/body/pose_builder.h"
#include "generator/imos/vocabulary.h"
#include "generator/nn/random_stream.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/seed.h"
#include "solver/actions/action_measures.h"
#include "solver/actions/action_motion.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/fit.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kVariety = 4.0;     // random cost range, for variety of grasps
constexpr std::uint64_t kBlows = 7;  // random stream of hammer blows
constexpr double kInHand = 0.35;     // fraction of clips that start without a table

ActionScene SceneOf(const ActionClipRequest& request, const BodyPlacement& start) {
  const Eigen::Matrix3Xd& rest = request.actor.Measures().rest_joints;
  ActionScene scene;
  scene.face = request.actor.Face();
  scene.object = request.prop.marks;
  scene.wrist_blows = request.wrist_blows;
  scene.head = start.WorldFromJoint(kHead);
  scene.shoulder = start.joints.col(17);
  scene.arm_m = (rest.col(19) - rest.col(17)).norm() + (rest.col(21) - rest.col(19)).norm();
  return scene;
}

// Converts the motion to a clip: finger angles, object track, holding_hand.
Clip ClipOf(const ActionActor& actor, const ActionMotion& motion, const ActionGrasp& grasp) {
  const Eigen::Matrix3Xd& rest = actor.Measures().rest_joints;
  Clip clip = ToClip(motion.frames, kActionRate, rest, JointPose::Zero());
  clip.object.emplace();
  clip.object->trans.resize(3, clip.NumFrames());
  clip.object->orient.setZero(3, clip.NumFrames());
  clip.holding_hand = motion.holding;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const auto at = static_cast<std::size_t>(t);
    for (const Side side : {Side::kRight, Side::kLeft}) {
      FingerPose fingers = RelaxedFingers(rest, side);
      const double closed = motion.closed[at][side == Side::kRight ? 0 : 1];
      if (side == Side::kRight || grasp.left) {
        fingers += closed * (grasp.Of(side).fingers - fingers);
      }
      SetFingers(clip.pose[at], side, fingers);
    }
    clip.object->SetPose(t, motion.object[at]);
  }
  return clip;
}

// Fits object and fingers with FitClip; the receiving hand of a handover has its own grasp.
Clip Fitted(const ActionClipRequest& request, const ActionGrasp& grasp, const Clip& clip) {
  std::vector<const HandModel*> hands = {&request.actor.Hand(Side::kRight)};
  if (grasp.left) hands.push_back(&request.actor.Hand(Side::kLeft));
  const GraspMaker grasps = [&](const GraspRequest& asked) {
    if (asked.frame == 0) return GraspPose{FingersOf(asked.pose, asked.side), {}};
    const Grasp& of_hand = grasp.Of(asked.side);
    const Isometry3d wrist = asked.object.Transform() * of_hand.wrist_from_object.inverse();
    return GraspPose{of_hand.fingers,
                     OffsetTo(request.actor.Hand(asked.side), wrist, asked.trans, asked.pose)};
  };
  return FitClip(clip, hands, request.prop.fit, clip.holding_hand, FitOptions(), grasps).clip;
}

// Script, grasp and key poses of a clip; `grasp` is null if `made` has a fault.
struct Chosen {
  ActionScript script;
  ActionChoice choice;
  const ActionGrasp* grasp = nullptr;
};

Chosen Choose(const ActionClipRequest& request, std::optional<bool> in_hand, ActionClip& made) {
  Chosen chosen;
  const bool handover = request.action == "offhand";
  const std::vector<ActionGrasp>& grasps = handover ? request.grasps.paired : request.grasps.single;
  if (grasps.empty()) {
    made.fault = handover ? "no room for both hands" : "no grasp";
    return chosen;
  }
  const ActionActor& actor = request.actor;
  RandomDraws draws(request.seed);
  const BodyPlacement start =
      Place(actor.Measures().rest_joints, IdleMotion(actor.Measures(), request.start, 1).front());
  ActionScene scene = SceneOf(request, start);
  scene.in_hand = draws.Uniform(0.0, 1.0) < kInHand;
  if (in_hand) scene.in_hand = *in_hand;
  chosen.script = WriteScript(request.action, scene, draws);
  std::vector<double> offsets;
  for (const ActionGrasp& grasp : grasps) {
    offsets.push_back(kVariety * draws.Uniform(0.0, 1.0) - 0.5 * grasp.right.score);
  }
  chosen.choice = ChooseKeys(actor, start, chosen.script, grasps, offsets, request.prop.samples);
  made.quality.worst_key = chosen.choice.worst_key;
  std::tie(made.fault, made.detail) =
      FaultOf(ActionQuality{.worst_key = chosen.choice.worst_key, .contact = 1.0}, request.action);
  if (made.fault.empty()) chosen.grasp = &grasps[chosen.choice.grasp];
  return chosen;
}

// Adds what the motion does not say: person, action, object, and the table on which the object
// stands in the first frame, if any.
void Label(const ActionClipRequest& request, const ActionScript& script, Clip& clip) {
  clip.betas = request.actor.Betas();
  clip.body_model = request.actor.Model().Name();
  clip.action = request.action;
  clip.object->name = imos::VocabularyName(request.prop.name);
  if (!script.table_m) return;
  const Vector3d low = clip.object->trans.col(0);
  clip.table.emplace();
  clip.table->name = "table";
  clip.table->trans = Vector3d(low.x(), low.y(), *script.table_m).replicate(1, clip.NumFrames());
  clip.table->orient = Eigen::Matrix3Xd::Zero(3, clip.NumFrames());
}

}  // namespace

ActionClip MakeActionStart(const ActionClipRequest& request, std::optional<bool> in_hand) {
  ActionClip made;
  Chosen chosen = Choose(request, in_hand, made);
  if (chosen.grasp == nullptr) return made;
  const ActionActor& actor = request.actor;
  // Only the first key, for as long as the whole body takes to settle.
  constexpr double kStill_s = 0.5;
  ActionScript& script = chosen.script;
  script.duration_s = kStill_s;
  script.keys.resize(1);
  script.keys[0].leave_s = kStill_s;
  script.strokes.clear();
  script.handover.reset();
  chosen.choice.keys.resize(1);
  const std::vector<BodyFrame> idle = IdleMotion(actor.Measures(), request.start, FramesOf(script));
  const ActionMotion motion = MakeActionMotion(actor, script, *chosen.grasp, chosen.choice, idle);
  made.quality.hand_error_rad = motion.worst_hand_error_rad;
  made.quality.shortfall_m = motion.worst_shortfall_m;
  made.clip = Slice(ClipOf(actor, motion, *chosen.grasp), 0, 1);
  Label(request, script, made.clip);
  if (request.mirrored) made.clip = MirrorClip(made.clip, actor.Measures().rest_joints.col(0));
  return made;
}

ActionClip MakeActionClip(const ActionClipRequest& request) {
  ActionClip made;
  const Chosen chosen = Choose(request, {}, made);
  if (chosen.grasp == nullptr) return made;
  const ActionActor& actor = request.actor;
  const ActionScript& script = chosen.script;
  const ActionGrasp& grasp = *chosen.grasp;
  const std::vector<BodyFrame> idle = IdleMotion(actor.Measures(), request.start, FramesOf(script));
  const ActionMotion motion = MakeActionMotion(actor, script, grasp, chosen.choice, idle);
  made.quality.hand_error_rad = motion.worst_hand_error_rad;
  made.quality.shortfall_m = motion.worst_shortfall_m;

  Clip clip = ClipOf(actor, motion, grasp);
  // Other strokes, and wrist-only blows, are already part of the scripts.
  if (request.action == "use" && !request.wrist_blows) {
    AddStrokes(actor.Measures().rest_joints, request.action, request.prop.marks,
               MixSeed(request.seed, kBlows), clip.NumFrames(), clip);
  }
  made.clip = Fitted(request, grasp, clip);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    made.quality.slipped_mm =
        std::max(made.quality.slipped_mm,
                 1000.0 * (clip.object->trans.col(t) - made.clip.object->trans.col(t)).norm());
  }
  Label(request, script, made.clip);
  MeasureAction(actor, request.prop, made.clip, made.quality);
  std::tie(made.fault, made.detail) = FaultOf(made.quality, request.action);
  if (request.mirrored) made.clip = MirrorClip(made.clip, actor.Measures().rest_joints.col(0));
  return made;
}

}  // namespace holdfast
