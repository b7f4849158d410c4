// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesis_motion.h"

#include <algorithm>
#include <cmath>

#include "generator/actions/standing_start.h"
#include "generator/matching/foot_lock.h"
#include "generator/matching/leg_placement.h"
#include "generator/matching/sole_contact.h"
#include "geometry/clip/resample.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kStep_m = 0.15;  // feet that stay this near to where they began take no step

bool Stands(const Eigen::Matrix3Xd& rest_joints, const std::vector<BodyFrame>& frames) {
  const FeetTarget first = FeetOf(Place(rest_joints, frames.front()));
  for (const BodyFrame& frame : frames) {
    const FeetTarget feet = FeetOf(Place(rest_joints, frame));
    for (int side = 0; side < 2; ++side) {
      if ((feet.ankle[side] - first.ankle[side]).norm() > kStep_m) return false;
    }
  }
  return true;
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

// What a person who stands does besides, from nothing in the first frame on.
void Sway(const BodyMeasures& measures, double frame_rate, std::uint64_t seed,
          std::vector<BodyFrame>& frames) {
  constexpr double kIdleRate = 30.0;  // of IdleMotion, Hz
  const double step = kIdleRate / frame_rate;
  const int count = static_cast<int>(std::ceil(step * static_cast<double>(frames.size()))) + 2;
  const std::vector<BodyFrame> idle = IdleMotion(measures, OwnStanding(measures, seed), count);
  const PlanarMove move = AlignHeading(idle.front(), frames.front());
  const BodyFrame& first = idle.front();
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double at = step * static_cast<double>(t);
    const std::size_t before = static_cast<std::size_t>(at);
    const BodyFrame now =
        Interpolate(idle[before], idle[before + 1], at - static_cast<double>(before));
    frames[t].pelvis += move * now.pelvis - move * first.pelvis;
    for (int j = 1; j < kNumBodyJoints; ++j) {
      frames[t].local[j] = frames[t].local[j] * (first.local[j].conjugate() * now.local[j]);
    }
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

Clip MotionOfKeyFrames(const Clip& keys, const BodyMeasures& measures, double frame_rate,
                       std::uint64_t seed) {
  Clip clip = ResampleSmoothly(keys, frame_rate);
  const Eigen::Matrix3Xd& rest_joints = measures.rest_joints;
  std::vector<BodyFrame> frames = BodyFrames(clip, rest_joints);
  if (Stands(rest_joints, frames)) {
    const FeetTarget feet = FeetOf(Place(rest_joints, frames.front()));
    Sway(measures, frame_rate, seed, frames);
    PinFeet(rest_joints, feet, frames);
  } else {
    const SolePoints soles(rest_joints, measures.sole_y);
    std::vector<Soles> points;
    for (const BodyFrame& frame : frames) points.push_back(soles.At(Place(rest_joints, frame)));
    LockFeet(rest_joints, soles, FindContacts(points, frame_rate), frames);
  }
  SetBodyFrames(frames, rest_joints, clip);
  return clip;
}

}  // namespace holdfast
