// SPDX-License-Identifier: MIT
#include "generator/matching/body_frame.h"

#include <cmath>

#include "geometry/rotation.h"

namespace holdfast {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

BodyPlacement Place(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame) {
  BodyPlacement placed;
  placed.rotation[0] = frame.local[0].toRotationMatrix();
  placed.joints.col(0) = frame.pelvis;
  for (int j = 1; j < kNumBodyJoints; ++j) {
    const int parent = kJointParents[j];
    placed.rotation[j] = placed.rotation[parent] * frame.local[j].toRotationMatrix();
    placed.joints.col(j) = placed.joints.col(parent) +
                           placed.rotation[parent] * (rest_joints.col(j) - rest_joints.col(parent));
  }
  return placed;
}

std::vector<BodyPlacement> Place(const Eigen::Matrix3Xd& rest_joints,
                                 std::span<const BodyFrame> frames) {
  std::vector<BodyPlacement> placed;
  placed.reserve(frames.size());
  for (const BodyFrame& frame : frames) placed.push_back(Place(rest_joints, frame));
  return placed;
}

Vector3d PlanarMove::operator*(const Vector3d& point) const {
  Vector3d moved = point;
  moved.head<2>() = *this * Eigen::Vector2d(point.head<2>());
  return moved;
}

BodyFrame PlanarMove::operator*(const BodyFrame& frame) const {
  BodyFrame moved = frame;
  moved.pelvis = *this * frame.pelvis;
  moved.local[0] = Quaterniond(AngleAxisd(yaw_rad, Vector3d::UnitZ())) * frame.local[0];
  return moved;
}

double Yaw(const BodyFrame& frame) {
  const Vector3d lateral = frame.local[0] * Vector3d::UnitX();
  return std::atan2(lateral.y(), lateral.x());
}

PlanarMove AlignHeading(const BodyFrame& from, const BodyFrame& to) {
  PlanarMove move;
  move.yaw_rad = std::remainder(Yaw(to) - Yaw(from), 2.0 * M_PI);
  move.shift = to.pelvis.head<2>() -
               Eigen::Rotation2Dd(move.yaw_rad) * Eigen::Vector2d(from.pelvis.head<2>());
  return move;
}

BodyFrame Interpolate(const BodyFrame& from, const BodyFrame& to, double share) {
  if (share == 0.0) return from;
  BodyFrame between;
  between.pelvis = (1.0 - share) * from.pelvis + share * to.pelvis;
  for (int j = 0; j < kNumBodyJoints; ++j) {
    between.local[j] = from.local[j].slerp(share, to.local[j]);
  }
  return between;
}

std::vector<BodyFrame> BodyFrames(const Clip& clip, const Eigen::Matrix3Xd& rest_joints) {
  std::vector<BodyFrame> frames(clip.pose.size());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    frames[t].pelvis = clip.trans.col(static_cast<Eigen::Index>(t)) + rest_joints.col(0);
    for (int j = 0; j < kNumBodyJoints; ++j) {
      frames[t].local[j] = Quaterniond(ExpSO3(clip.pose[t].col(j)));
    }
  }
  return frames;
}

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

Clip ToClip(const std::vector<BodyFrame>& frames, double frame_rate,
            const Eigen::Matrix3Xd& rest_joints, const JointPose& hands) {
  Clip clip;
  clip.frame_rate = frame_rate;
  clip.trans.resize(3, static_cast<Eigen::Index>(frames.size()));
  clip.pose.assign(frames.size(), hands);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    clip.trans.col(static_cast<Eigen::Index>(t)) = frames[t].pelvis - rest_joints.col(0);
    for (int j = 0; j < kNumBodyJoints; ++j) {
      const Vector3d turn = LogSO3(frames[t].local[j].toRotationMatrix());
      clip.pose[t].col(j) = t == 0 ? turn : UnwrapAxisAngle(turn, clip.pose[t - 1].col(j));
    }
  }
  return clip;
}

BodyFrame Mirror(const BodyFrame& frame) {
  BodyFrame mirrored;
  mirrored.pelvis = Vector3d(-frame.pelvis.x(), frame.pelvis.y(), frame.pelvis.z());
  for (int j = 0; j < kNumBodyJoints; ++j) {
    const Quaterniond& q = frame.local[MirrorJoint(j)];
    mirrored.local[j] = Quaterniond(q.w(), q.x(), -q.y(), -q.z());
  }
  return mirrored;
}

}  // namespace holdfast
