// SPDX-License-Identifier: MIT
#include "generator/wandr/motion_states.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast::wandr {

StateMatrix<double> StatesOfClip(const Clip& clip) {
  if (clip.NumFrames() == 0) {
    throw Error("clip", "it has no frames", "Give a clip of one frame or more");
  }
  if (clip.frame_rate != kFramesPerSecond) return StatesOfClip(Resample(clip, kFramesPerSecond));
  StateMatrix<double> states(kStateSize, clip.NumFrames());
  for (int t = 0; t < clip.NumFrames(); ++t) {
    Pose<double> pose;
    pose.translation = clip.trans.col(t);
    for (int k = 0; k < kNumBodyJoints; ++k) {
      pose.rotation[k] = ExpSO3(clip.pose[t].col(k));
    }
    WriteState<double>(pose, states.col(t));
  }
  return states;
}

Eigen::MatrixXf JointsOfStates(const Eigen::Ref<const StateMatrix<float>>& states,
                               const BoneOffsets<float>& bones) {
  Eigen::MatrixXf joints(kJointNumbers, states.cols());
  BodyKinematics<float> kinematics;
  for (Eigen::Index f = 0; f < states.cols(); ++f) {
    ForwardKinematics(bones, PoseOf<float>(states.col(f)), kinematics);
    Eigen::Map<BodyJoints<float>>(joints.col(f).data()) = kinematics.joints;
  }
  return joints;
}

Clip ClipOfStates(const Eigen::Ref<const StateMatrix<double>>& states, const Clip& like) {
  Clip clip;
  clip.frame_rate = kFramesPerSecond;
  clip.betas = like.betas;
  clip.gender = like.gender;
  clip.surface_model_type = like.surface_model_type;
  clip.body_model = like.body_model;
  clip.v_template = like.v_template;
  clip.subject = like.subject;
  clip.action = like.action;
  clip.trans = states.topRows<3>();
  clip.pose.assign(states.cols(), JointPose::Zero());
  for (Eigen::Index t = 0; t < states.cols(); ++t) {
    const Pose<double> pose = PoseOf<double>(states.col(t));
    for (int k = 0; k < kNumBodyJoints; ++k) {
      const Eigen::Vector3d w = LogSO3(pose.rotation[k]);
      clip.pose[t].col(k) = t == 0 ? w : UnwrapAxisAngle(w, clip.pose[t - 1].col(k));
    }
  }
  return clip;
}

RolloutStart<double> StartAtFrame(const Eigen::Ref<const StateMatrix<double>>& states, int frame,
                                  const Normalizer<double>& normalizer) {
  if (frame < 0 || frame >= states.cols()) {
    throw Error(
        "start frame",
        fmt::format("frame {} does not exist: the motion has {} frames", frame, states.cols()),
        fmt::format("Give a frame of 0 to {} (at 30 fps)", states.cols() - 1));
  }
  const Pose<double> pose = PoseOf<double>(states.col(frame));
  if (frame == 0) return StartAtRest(pose, normalizer);
  const StateVector<double> delta = DeltaBetween(PoseOf<double>(states.col(frame - 1)), pose);
  return {pose, NormalizedDelta<double>(normalizer, delta)};
}

RolloutStart<double> StartAtRest(const Pose<double>& pose, const Normalizer<double>& normalizer) {
  return {pose, NormalizedDelta<double>(normalizer, RestDelta<double>())};
}

Pose<double> StandingPose(const BodyMeasures& body) {
  const auto about = [](double angle, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  Pose<double> pose;
  // In the rest pose y is up and z is ahead. Arms are lowered by 70 degrees, elbows bent by 15.
  pose.rotation[0] = about(std::numbers::pi / 2.0, x);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    const int wrist = WristJoint(side), elbow = kJointParents[wrist];
    pose.rotation[kJointParents[elbow]] = about(sign * 1.22, z);
    pose.rotation[elbow] = about(sign * 0.26, y);
  }
  const Eigen::Vector3d pelvis = body.rest_joints.col(0);
  pose.translation = -pelvis;
  pose.translation.z() += pelvis.y() - body.sole_y;
  return pose;
}

Pose<double> Moved(const Pose<double>& pose, double turn_rad, const Eigen::Vector3d& by,
                   const Eigen::Vector3d& rest_pelvis) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Pose<double> moved = pose;
  moved.translation = turn * (pose.translation + rest_pelvis) - rest_pelvis + by;
  moved.rotation[0] = turn * pose.rotation[0];
  return moved;
}

Pose<double> Mirrored(const Pose<double>& pose, const Eigen::Vector3d& rest_pelvis) {
  const Eigen::DiagonalMatrix<double, 3> mirror(-1.0, 1.0, 1.0);
  Pose<double> mirrored;
  mirrored.translation = mirror * (pose.translation + rest_pelvis) - rest_pelvis;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    mirrored.rotation[k] = mirror * pose.rotation[MirrorJoint(k)] * mirror;
  }
  return mirrored;
}

}  // namespace holdfast::wandr
