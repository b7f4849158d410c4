// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesis_motion.h"

#include <algorithm>
#include <cmath>

#include "generator/matching/foot_lock.h"
#include "generator/matching/leg_placement.h"
#include "generator/matching/sole_contact.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/resample.h"
#include "geometry/rotation.h"
#include "solver/synthesis/standing_life.h"

namespace holdfast {
namespace {

constexpr double kStep_m = 0.15;  // feet that stay this near to where they began take no step

bool Stands(const Eigen::Matrix3Xd& rest_joints, const std::vector<BodyFrame>& frames) {
  const std::vector<FeetTarget> feet = FeetOf(Place(rest_joints, frames));
  return std::ranges::all_of(feet, [&](const FeetTarget& at) {
    return (at.ankle[0] - feet.front().ankle[0]).norm() <= kStep_m &&
           (at.ankle[1] - feet.front().ankle[1]).norm() <= kStep_m;
  });
}

// Both feet stay; the pelvis sinks where legs would not reach.
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

void SetBodyFrames(const std::vector<BodyFrame>& frames, const Eigen::Matrix3Xd& rest_joints,
                   Clip& clip) {
  for (int t = 0; t < clip.NumFrames(); ++t) {
    clip.trans.col(t) = frames[t].pelvis - rest_joints.col(0);
    for (int j = 0; j < kNumBodyJoints; ++j) {
      clip.pose[t].col(j) =
          UnwrapAxisAngle(LogSO3(frames[t].local[j].toRotationMatrix()), clip.pose[t].col(j));
    }
  }
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
