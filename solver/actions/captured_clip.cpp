// SPDX-License-Identifier: MIT
#include "solver/actions/captured_clip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/imos/vocabulary.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/rotation.h"
#include "solver/actions/action_measures.h"
#include "solver/actions/action_motion.h"
#include "solver/actions/captured_brush.h"
#include "solver/carry/carry.h"
#include "solver/carry/drink.h"
#include "solver/markers/solve_markers.h"

namespace holdfast {
namespace {

// Maximum mean distance between rim and mouth, or bristles and head, of an accepted clip.
constexpr double kMaxFromKey_m = 0.025;

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

// Adds the surface on which the object stands before it is lifted.
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

// Adds the object to the clip; returns false with a fault in `made`.
bool Carry(const CapturedClipRequest& request, CapturedClip& made, CarryReport& carried) {
  CarryOptions options;
  options.seed = request.seed;
  options.drink = made.action.action == "drink";
  if (!options.drink) {
    options.grasp = GraspSource::kClips;
    const Grasp* const grasp =
        ServeBrush(request.actor, request.prop, request.grasps, made.action.side, made.action.act,
                   made.action.back, made.clip);
    if (grasp == nullptr) {
      made.fault = "no grasp";
      return false;
    }
  }
  const ClipBody body{request.model, request.actor.Betas()};
  try {
    carried = CarryObject(made.clip, body, request.object, options);
  } catch (const Error& error) {
    made.fault = options.drink ? "no drinking hand" : "no holding hand";
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
    throw Error(files.recording.string(), "has no static trial in its folder",
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
    throw Error(files.recording.string(), "has no hand that drinks or combs the hair",
                "Give trials in which a person drinks from a cup on a table, or combs");
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
  std::tie(made.fault, made.detail) = FaultOf(made.quality, captured.action);
  if (made.fault.empty() && made.key_mean_m > kMaxFromKey_m) {
    made.fault = carried.drunk ? "rim misses the mouth" : "bristles miss the head";
    made.detail = fmt::format("by {:.0f} mm", 1e3 * made.key_mean_m);
  }
  return made;
}

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kOnHead_m = 0.1;
constexpr double kBehindEyes_m = 0.08;
constexpr double kStillShare = 0.1;                // of the maximum speed
constexpr double kRest_s = 0.3;                    // kept before the reach and after the return
constexpr double kPlaced_m = 0.15, kFree_m = 0.4;  // distance of the palm from the face

// Position of one palm relative to the head in all frames.
struct OverHead {
  Eigen::VectorXd from_skin;  // meters; large if the palm is below the mouth
  bool behind_eyes = false;   // at some frame near the head
};

OverHead OverHeadOf(const PalmTracks& tracks, const FaceMarks& face, const SignedDistance& head,
                    Side side) {
  constexpr double kFar_m = 1.0;
  OverHead over;
  const Matrix3Xd& at = tracks.Of(side);
  over.from_skin.setConstant(at.cols(), kFar_m);
  for (Eigen::Index t = 0; t < at.cols(); ++t) {
    const Vector3d palm = tracks.head[t].inverse() * Vector3d(at.col(t));
    if (palm.y() < face.mouth.y()) continue;
    over.from_skin(t) = head.Distance(palm);
    over.behind_eyes |= over.from_skin(t) < kOnHead_m && palm.z() < face.eyes.z() - kBehindEyes_m;
  }
  return over;
}

// Returns the first and last frame of [0, count) for which `is` holds.
template <typename Is>
std::optional<std::pair<int, int>> Span(int count, const Is& is) {
  int first = 0, last = count - 1;
  while (first < count && !is(first)) ++first;
  while (last >= first && !is(last)) --last;
  if (first > last) return std::nullopt;
  return std::pair(first, last);
}

void FindEnds(const PalmTracks& tracks, CapturedAction& action) {
  const Eigen::VectorXd speed = tracks.Speed(action.side);
  const int frames = static_cast<int>(speed.size());
  const int rest = static_cast<int>(std::lround(kRest_s * tracks.frame_rate));
  const double still = kStillShare * speed.maxCoeff();
  const auto moving = Span(frames, [&](int t) { return speed(t) > still; });
  action.begin = std::max(0, std::min(moving ? moving->first : 0, action.act) - rest);
  action.end = std::min(frames, std::max(moving ? moving->second : frames, action.back) + rest + 1);
}

}  // namespace

std::optional<CapturedAction> FindCapturedAction(const Clip& clip, const CapturedPerson& person) {
  const PalmTracks tracks = TrackPalms(clip, person.rest_joints);
  CapturedAction action;
  if (const auto drink = FindDrink(tracks, person.face)) {
    action.action = "drink";
    action.side = drink->side;
    action.act = drink->lift;
    action.key = drink->drink;
    action.back = drink->put_down;
    FindEnds(tracks, action);
    return action;
  }
  const SignedDistance head(person.face.head);
  const std::array<OverHead, 2> both = {OverHeadOf(tracks, person.face, head, Side::kRight),
                                        OverHeadOf(tracks, person.face, head, Side::kLeft)};
  const bool right = both[0].from_skin.minCoeff() <= both[1].from_skin.minCoeff();
  const OverHead& palm = both[right ? 0 : 1];
  if (!palm.behind_eyes) return std::nullopt;
  const auto over = Span(clip.NumFrames(), [&](int t) { return palm.from_skin(t) < kOnHead_m; });
  if (!over) return std::nullopt;
  action.action = "brush";
  action.side = right ? Side::kRight : Side::kLeft;
  action.act = over->first;
  action.key = (over->first + over->second) / 2;
  action.back = over->second + 1;
  FindEnds(tracks, action);
  return action;
}

Clip RetargetCaptured(const Clip& clip, const CapturedAction& action, const CapturedPerson& from,
                      const BodyMeasures& body, const FaceMarks& face, RestPosture posture,
                      const BodyFrame& standing) {
  const Clip part = Slice(clip, action.begin, action.end);
  std::vector<BodyFrame> frames = BodyFrames(part, from.rest_joints);
  const PlanarMove turn = AlignHeading(frames.front(), BodyFrame());
  const BodyPlacement stands = Place(body.rest_joints, standing);
  for (BodyFrame& frame : frames) {
    frame = turn * frame;
    if (posture == RestPosture::kSeated) continue;
    for (const int joint :
         {kLeftKnee, kRightKnee, kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot}) {
      frame.local[joint] = standing.local[joint];
    }
    for (const int hip : {kLeftHip, kRightHip}) {
      frame.local[hip] = frame.local[0].conjugate() * Eigen::Quaterniond(stands.rotation[hip]);
    }
  }
  const BodyPlacement first = Place(body.rest_joints, frames.front());
  const double raise = std::min(body.rest_joints(1, kLeftAnkle), body.rest_joints(1, kRightAnkle)) -
                       body.sole_y -
                       std::min(first.joints(2, kLeftAnkle), first.joints(2, kRightAnkle));
  for (BodyFrame& frame : frames) frame.pelvis.z() += raise;
  Clip moved = ToClip(frames, clip.frame_rate, body.rest_joints, JointPose::Zero());

  const bool drinks = action.action == "drink";
  const Vector3d mark = drinks ? face.mouth : face.eyes;
  const Vector3d mark_before = drinks ? from.face.mouth : from.face.eyes;
  BodyState was, is;
  for (int t = 0; t < moved.NumFrames(); ++t) {
    JointPose& pose = moved.pose[t];
    const JointPose& captured = part.pose[t];
    pose.rightCols<kNumJoints - kNumBodyJoints>() =
        captured.rightCols<kNumJoints - kNumBodyJoints>();
    ForwardJoints(from.rest_joints, captured, part.trans.col(t), was);
    ForwardJoints(body.rest_joints, pose, moved.trans.col(t), is);
    const int wrist_joint = WristJoint(action.side);
    const Isometry3d head = is.WorldFromJoint(kHead), wrist = is.WorldFromJoint(wrist_joint);
    const Isometry3d in_head =
        was.WorldFromJoint(kHead).inverse() * was.WorldFromJoint(wrist_joint);
    const double away = (PalmOf(action.side, in_head) - mark_before).norm();
    const double share = 1.0 - MinimumJerk((away - kPlaced_m) / (kFree_m - kPlaced_m));
    if (share <= 0.0) continue;
    const Vector3d wanted = head * Vector3d(in_head.translation() + mark - mark_before);
    MoveWrist(body.rest_joints, action.side, wrist.linear(),
              wrist.translation() + share * (wanted - wrist.translation()), moved.trans.col(t),
              pose);
  }
  return moved;
}

}  // namespace holdfast
