// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesis.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "generator/imos/action_sequence.h"
#include "generator/matching/foot_lock.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/synthesis/standing_life.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMeet_m = 0.25;    // maximum distance of palms that pass an object
constexpr double kLeaves_m = 0.01;  // increase in distance at which they separate

wandr::Pose<double> BodyPoseOf(const Clip& clip, int frame, const imos::CanonicalFrame& canonical) {
  wandr::Pose<double> pose;
  pose.translation = canonical.TranslFromWorld(clip.trans.col(frame));
  for (int j = 0; j < kNumBodyJoints; ++j) pose.rotation[j] = ExpSO3(clip.pose[frame].col(j));
  pose.rotation[0] = canonical.RotationFromWorld(pose.rotation[0]);
  return pose;
}

// Distance of the palm centers: halfway from wrist to the middle finger's knuckle.
double PalmsApart(const JointPose& pose, const Eigen::Matrix3Xd& rest_joints) {
  wandr::Pose<double> body;
  for (int j = 0; j < kNumBodyJoints; ++j) body.rotation[j] = ExpSO3(pose.col(j));
  wandr::BodyKinematics<double> placed;
  wandr::ForwardKinematics(wandr::BoneOffsetsOf(rest_joints), body, placed);
  const auto palm = [&](Side side) -> Vector3d {
    const int wrist = WristJoint(side), knuckle = side == Side::kLeft ? 28 : 43;
    return placed.joints.col(wrist) +
           0.5 * (placed.world[wrist] * (rest_joints.col(knuckle) - rest_joints.col(wrist)));
  };
  return (palm(Side::kRight) - palm(Side::kLeft)).norm();
}

// The object of one sample over the key frames.
class ObjectInHands {
 public:
  ObjectInHands(const SynthesisScene& scene, const Clip& history,
                const imos::CanonicalFrame& canonical, const FitOptions& options)
      : scene_(scene),
        canonical_(canonical),
        fitter_(scene.hands, scene.object, options, scene.seconds_per_key_frame),
        last_pose_(history.pose.back()),
        last_trans_(history.trans.rightCols<1>()) {
    const Eigen::Index last = history.NumFrames() - 1;
    fitter_.Place(ObjectPose(history.object->Pose(last)));
    holding_ = history.holding_hand.back();
    for (const HandModel* hand : scene.hands) {
      const Side side = hand->HandSide();
      if ((holding_ & HoldingBit(side)) == 0) continue;
      fitter_.TakeHold(side, last_pose_, last_trans_, FingersOf(last_pose_, side));
    }
  }

  // Returns the world pose of the object for the next body.
  ObjectPose Next(int frame, const wandr::Pose<double>& body, Synthesized& result) {
    JointPose pose = last_pose_;
    for (int j = 0; j < kNumBodyJoints; ++j) {
      const Matrix3d R = j == 0 ? canonical_.RotationToWorld(body.rotation[0]) : body.rotation[j];
      pose.col(j) = UnwrapAxisAngle(LogSO3(R), last_pose_.col(j));
    }
    const Vector3d trans = canonical_.TranslToWorld(body.translation);
    if (scene_.changes_hands && result.switch_frame < 0) PassOn(frame, pose, result);
    result.reports.push_back(fitter_.Solve(pose, trans));
    result.clip.pose.push_back(pose);
    result.clip.trans.col(frame) = trans;
    result.clip.holding_hand.push_back(holding_);
    const ObjectPose& object = fitter_.Object();
    result.clip.object->SetPose(frame, object.Transform());
    last_pose_ = pose;
    last_trans_ = trans;
    return object;
  }

 private:
  // Lets the other hand take over in the last frame if the palms separate now.
  void PassOn(int frame, const JointPose& pose, Synthesized& result) {
    const bool right = (holding_ & kHoldsRight) != 0;
    if (right == ((holding_ & kHoldsLeft) != 0)) return;
    const Side from = right ? Side::kRight : Side::kLeft, to = right ? Side::kLeft : Side::kRight;
    const double before = PalmsApart(last_pose_, scene_.rest_joints),
                 now = PalmsApart(pose, scene_.rest_joints);
    if (before > kMeet_m || now < before + kLeaves_m) return;
    FingerPose fingers = FingersOf(last_pose_, from);
    // Mirroring at x = 0 maps (x, y, z) to (x, -y, -z).
    for (int i = 0; i < fingers.size(); ++i) {
      if (i % 3 != 0) fingers[i] = -fingers[i];
    }
    fitter_.TakeHold(to, last_pose_, last_trans_, fingers);
    fitter_.Release(from);
    holding_ = HoldingBit(to);
    result.switch_frame = frame;
  }

  const SynthesisScene& scene_;
  const imos::CanonicalFrame& canonical_;
  FrameFitter fitter_;
  JointPose last_pose_;
  Vector3d last_trans_;
  std::uint8_t holding_ = 0;
};

}  // namespace

Clip HistoryOf(const Clip& start, double seconds_per_key_frame) {
  if (start.NumFrames() == 0) {
    throw Error("start", "has no frames", "Give a clip of a person who holds the object");
  }
  if (!start.object) {
    throw Error("start", "has no object track",
                "Give a clip of a person who holds the object, as written by 'holdfast fit' and "
                "'holdfast grasp'");
  }
  if (start.holding_hand.empty() || start.holding_hand.back() == 0) {
    throw Error("holding_hand", "no hand holds the object in the last frame of the start",
                "Give a start whose last frame has the object in a hand");
  }
  const double step = seconds_per_key_frame * start.frame_rate;
  Clip history = Slice(start, 0, 1);
  history.frame_rate = 1.0 / seconds_per_key_frame;
  history.contact.reset();
  history.pose.clear();
  history.holding_hand.clear();
  history.trans.resize(3, imos::kHistory);
  history.object->trans.resize(3, imos::kHistory);
  history.object->orient.resize(3, imos::kHistory);
  history.table.reset();
  for (int k = 0; k < imos::kHistory; ++k) {
    const double at = std::max(0.0, start.NumFrames() - 1.0 - step * (imos::kHistory - 1 - k));
    // Times within rounding of a frame are snapped to it, to avoid interpolation.
    constexpr double kRounding = 1e-6;
    const int before = static_cast<int>(at + kRounding);
    const int after = std::min(before + 1, start.NumFrames() - 1);
    Clip two = Slice(start, before, before + 1);
    if (at > before + kRounding) {
      two = Slice(start, before, after + 1);
      two.frame_rate = 1.0;
      two = Slice(Resample(two, 1.0 / (at - before)), 1, 2);
    }
    history.pose.push_back(two.pose[0]);
    history.trans.col(k) = two.trans.col(0);
    history.object->trans.col(k) = two.object->trans.col(0);
    history.object->orient.col(k) = two.object->orient.col(0);
    history.holding_hand.push_back(start.holding_hand.back());
  }
  return history;
}

std::vector<Synthesized> Synthesize(const imos::Network<float>& network,
                                    const Eigen::Ref<const Eigen::MatrixXf>& action_table,
                                    const SynthesisScene& scene, const FitOptions& fit,
                                    int num_samples, std::uint64_t seed, std::uint64_t first_stream,
                                    double sigma, int threads) {
  const Clip history = HistoryOf(scene.start, scene.seconds_per_key_frame);
  const imos::CanonicalFrame canonical = imos::CanonicalFrameOf(
      ExpSO3(history.pose[0].col(0)), history.trans.col(0), scene.rest_joints.col(0));
  const imos::ObjectRotation rotation = network.Options().object_rotation;
  const auto column = [&](const Matrix3d& R, const Vector3d& T) {
    return imos::ObjectColumn(canonical.RotationFromWorld(R), canonical.PointFromWorld(T),
                              rotation);
  };
  imos::SynthesisStart start;
  for (int k = 0; k < imos::kHistory; ++k) {
    const wandr::Pose<double> pose = BodyPoseOf(history, k, canonical);
    start.poses.col(k) = imos::PoseColumn(pose);
    start.roots.col(k) = pose.translation;
    start.objects.col(k) =
        column(ExpSO3(history.object->orient.col(k)), history.object->trans.col(k));
  }
  start.condition = imos::ConditionOf(scene.start.betas, scene.intent, action_table);

  std::vector<Synthesized> results(num_samples);
  for (Synthesized& result : results) {
    result.clip = history;
    result.clip.trans.conservativeResize(3, scene.key_frames);
    result.clip.object->trans.conservativeResize(3, scene.key_frames);
    result.clip.object->orient.conservativeResize(3, scene.key_frames);
  }
  std::vector<std::unique_ptr<ObjectInHands>> objects(num_samples);
  const std::vector<imos::SynthesisStart> starts(num_samples, start);
  imos::SynthesisRequest request;
  request.starts = starts;
  request.num_frames = scene.key_frames;
  request.seed = seed;
  request.first_stream = first_stream;
  request.sigma = sigma;
  imos::RunSynthesis(
      network, request,
      [&](int sample, int frame, const wandr::Pose<double>& pose) {
        std::unique_ptr<ObjectInHands>& object = objects[sample];
        if (!object) {
          object = std::make_unique<ObjectInHands>(scene, history, canonical, fit);
        }
        const ObjectPose now = object->Next(frame, pose, results[sample]);
        if (frame + 1 == scene.key_frames) object.reset();
        return column(now.orientation.toRotationMatrix(), now.translation);
      },
      threads);
  return results;
}

namespace {

constexpr double kStep_m = 0.15;  // feet that stay this close to their start take no step

bool Stands(const Eigen::Matrix3Xd& rest_joints, const std::vector<BodyFrame>& frames) {
  const std::vector<FeetTarget> feet = FeetOf(Place(rest_joints, frames));
  return std::ranges::all_of(feet, [&](const FeetTarget& at) {
    return (at.ankle[0] - feet.front().ankle[0]).norm() <= kStep_m &&
           (at.ankle[1] - feet.front().ankle[1]).norm() <= kStep_m;
  });
}

// Both feet stay fixed; the pelvis is lowered where legs do not reach.
void PinFeet(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& target,
             std::vector<BodyFrame>& frames) {
  const std::vector<FeetTarget> feet(frames.size(), target);
  const std::vector<double> sink = PelvisSink(rest_joints, frames, feet);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    frames[t].pelvis.z() -= sink[t];
    PlaceLegs(rest_joints, feet[t], frames[t]);
  }
}

}  // namespace

std::vector<double> HandDistances(const std::vector<BodyPlacement>& placed) {
  const auto hand = [](const BodyPlacement& frame) -> Vector3d {
    return frame.WorldFromJoint(kSpine3).inverse() * frame.joints.col(kRightWrist);
  };
  std::vector<double> distances;
  for (const BodyPlacement& frame : placed) {
    distances.push_back((hand(frame) - hand(placed.front())).norm());
  }
  return distances;
}

std::vector<Eigen::Isometry3d> HoldingHands(const Eigen::Matrix3Xd& rest_joints,
                                            const std::vector<BodyFrame>& frames,
                                            const Clip& clip) {
  std::vector<Eigen::Isometry3d> hands;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const bool right = t >= clip.holding_hand.size() || clip.holding_hand[t] != kHoldsLeft;
    hands.push_back(Place(rest_joints, frames[t]).WorldFromJoint(right ? kRightWrist : kLeftWrist));
  }
  return hands;
}

void TakeAlong(const Eigen::Matrix3Xd& rest_joints, const std::vector<BodyFrame>& frames,
               const std::vector<Eigen::Isometry3d>& hands, Clip& clip) {
  if (!clip.object) return;
  const std::vector<Eigen::Isometry3d> now = HoldingHands(rest_joints, frames, clip);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const auto frame = static_cast<Eigen::Index>(t);
    clip.object->SetPose(frame, now[t] * hands[t].inverse() * clip.object->Pose(frame));
  }
}

Clip MotionOfKeyFrames(const Clip& keys, const BodyMeasures& measures, double frame_rate,
                       std::uint64_t seed) {
  Clip clip = ResampleSmoothly(keys, frame_rate);
  const Eigen::Matrix3Xd& rest_joints = measures.rest_joints;
  std::vector<BodyFrame> frames = BodyFrames(clip, rest_joints);
  const std::vector<Eigen::Isometry3d> hands = HoldingHands(rest_joints, frames, clip);
  if (Stands(rest_joints, frames)) {
    const FeetTarget feet = FeetOf(Place(rest_joints, frames.front()));
    AddSway(frame_rate, seed, frames);
    PinFeet(rest_joints, feet, frames);
  } else {
    const SolePoints soles(rest_joints, measures.sole_y);
    const std::vector<Soles> points = soles.At(Place(rest_joints, frames));
    LockFeet(rest_joints, soles, FindContacts(points, frame_rate), frames);
  }
  TakeAlong(rest_joints, frames, hands, clip);
  SetBodyFrames(frames, rest_joints, clip);
  return clip;
}

}  // namespace holdfast
