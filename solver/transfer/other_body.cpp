// SPDX-License-Identifier: MIT
#include "solver/transfer/other_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr std::array<Side, 2> kSides = {Side::kLeft, Side::kRight};

// Rest joints, and the heights of an ankle and of the head above the sole.
struct Stature {
  explicit Stature(const ClipBody& body) {
    const Matrix3Xd shaped = body.model->ShapedVertices(body.betas);
    joints = body.model->RestJoints(shaped);
    sole = joints(1, kLeftAnkle) - shaped.row(1).minCoeff();
    head = joints(1, kHead) - shaped.row(1).minCoeff();
  }
  double Leg() const {
    return (joints.col(kLeftHip) - joints.col(kLeftKnee)).norm() +
           (joints.col(kLeftKnee) - joints.col(kLeftAnkle)).norm();
  }
  double Hand() const { return (joints.col(kRightHandBegin + 3) - joints.col(kRightWrist)).norm(); }

  Matrix3Xd joints;
  double sole = 0.0, head = 0.0;
};

// World pose of a joint in a frame.
Isometry3d WorldOf(const Matrix3Xd& rest, const Clip& clip, int t, int joint) {
  BodyState state;
  ForwardJoints(rest, clip.pose[t], clip.trans.col(t), state);
  return state.WorldFromJoint(joint);
}

// Horizontal shift of the body that brings all wrists within reach: repeatedly steps towards the
// wrist that is farthest out of reach.
Eigen::Vector2d StepTowards(const Matrix3Xd& rest, const std::vector<WristPath>& paths,
                            const Clip& clip) {
  constexpr double kMost_m = 0.4, kNearlyStraight = 0.985;
  constexpr int kRounds = 60;
  std::vector<std::pair<Vector3d, double>> reaches;  // from shoulder to wrist; length of the arm
  for (const WristPath& path : paths) {
    const int shoulder = path.side == Side::kRight ? kRightShoulder : kLeftShoulder;
    const double length = kNearlyStraight * MaxReach(rest, Arm(path.side));
    for (int t = path.begin; t < path.end; ++t) {
      reaches.emplace_back(
          path.wrist[t - path.begin].translation() - WorldOf(rest, clip, t, shoulder).translation(),
          length);
    }
  }
  Eigen::Vector2d step = Eigen::Vector2d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    double worst = 0.0;
    Eigen::Vector2d towards = Eigen::Vector2d::Zero();
    for (auto [way, length] : reaches) {
      way.head<2>() -= step;
      const double lacks = way.norm() - length;
      if (lacks <= worst) continue;
      worst = lacks;
      const Eigen::Vector2d flat = way.head<2>();
      towards = flat.norm() > 1e-6 ? Eigen::Vector2d(flat.normalized()) : Eigen::Vector2d::Zero();
    }
    if (worst <= 0.0) break;
    step += 0.7 * (worst + 0.002) * towards;
    if (step.norm() > kMost_m) step *= kMost_m / step.norm();
  }
  return step;
}

}  // namespace

OntoBody OntoOtherBody(const Clip& clip, const ClipBody& from, const ClipBody& to) {
  if (from.model->LoneHand() != to.model->LoneHand()) {
    throw Error("body", "differs from the clip's body: one is a hand, the other a whole body",
                "Convert the clip to it first ('holdfast convert')");
  }
  const Stature before(from), after(to);
  OntoBody onto{clip, {}};
  OtherBodyReport& out = onto.report;
  out.fingers_ratio = after.Hand() / before.Hand();
  Clip& moved = onto.clip;
  moved.betas = to.betas;
  moved.body_model = to.model->Name();
  moved.v_template.resize(3, 0);
  if (to.model->IsSubject()) moved.v_template = to.model->Template();
  if (to.model->LoneHand()) {
    const int wrist = WristJoint(*to.model->LoneHand());
    moved.trans.colwise() += before.joints.col(wrist) - after.joints.col(wrist);
    return onto;
  }
  out.leg_ratio = after.Leg() / before.Leg();
  out.height_ratio = after.head / before.head;
  std::vector<BodyFrame> frames = BodyFrames(clip, before.joints);
  std::vector<FeetTarget> feet = FeetOf(Place(before.joints, frames));
  for (std::size_t t = 0; t < frames.size(); ++t) {
    double lowest = feet[t].ankle[0].z();
    for (Vector3d& ankle : feet[t].ankle) {
      lowest = std::min(lowest, ankle.z());
      ankle.z() += after.sole - before.sole;
    }
    double& height = frames[t].pelvis.z();
    height = lowest + after.sole - before.sole + out.leg_ratio * (height - lowest);
  }
  const std::vector<double> sink = PelvisSink(after.joints, frames, feet);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    frames[t].pelvis.z() -= sink[t];
    out.sink_m = std::max(out.sink_m, sink[t]);
    out.ankle_missed_m = std::max(out.ankle_missed_m, PlaceLegs(after.joints, feet[t], frames[t]));
    moved.trans.col(t) = frames[t].pelvis - after.joints.col(kPelvis);
    for (const Side side : kSides) {
      const Limb leg = Leg(side);
      for (const int joint : {leg.root, leg.middle, leg.end}) {
        const Vector3d turn = LogSO3(frames[t].local[joint].toRotationMatrix());
        moved.pose[t].col(joint) = UnwrapAxisAngle(turn, clip.pose[t].col(joint));
      }
    }
  }
  return onto;
}

ArmReport BringWrists(const ClipBody& body, const std::vector<WristPath>& paths, double blend_s,
                      Clip& clip) {
  ArmReport report;
  const Matrix3Xd rest = body.model->RestJoints(body.model->ShapedVertices(body.betas));
  const bool lone = body.model->LoneHand().has_value();
  if (!lone) {
    const Eigen::Vector2d step = StepTowards(rest, paths, clip);
    report.step_m = step.norm();
    clip.trans.topRows<2>().colwise() += step;
  }
  const int blend = std::max(1, static_cast<int>(std::lround(blend_s * clip.frame_rate)));
  int frames = 0;
  for (const Side side : kSides) {
    // Offset from the clip's wrist in every frame, with its blend weight.
    const auto count = static_cast<std::size_t>(clip.NumFrames());
    std::vector<std::pair<double, Isometry3d>> wanted(count, {0.0, Isometry3d::Identity()});
    const auto offset_at = [&](const WristPath& path, int t) {
      return WorldOf(rest, clip, t, WristJoint(side)).inverse() * path.wrist[t - path.begin];
    };
    for (const WristPath& path : paths) {
      if (path.side != side || path.end <= path.begin) continue;
      for (int t = path.begin; t < path.end; ++t) {
        wanted[t] = {1.0, offset_at(path, t)};
      }
      const Isometry3d first = offset_at(path, path.begin), last = offset_at(path, path.end - 1);
      for (int k = 1; k < blend; ++k) {
        const double share = MinimumJerk(1.0 - static_cast<double>(k) / blend);
        for (const auto& [t, offset] :
             {std::pair(path.begin - k, first), std::pair(path.end - 1 + k, last)}) {
          if (t < 0 || t >= clip.NumFrames()) continue;
          auto& held = wanted[t];
          if (held.first < share) held = {share, offset};
        }
      }
    }
    for (int t = 0; t < clip.NumFrames(); ++t) {
      const auto& [share, offset] = wanted[t];
      if (share == 0.0) continue;
      const Vector3d turn = share * LogSO3(offset.linear());
      const Vector3d way = share * offset.translation();
      JointPose& pose = clip.pose[t];
      const Isometry3d wrist = WorldOf(rest, clip, t, WristJoint(side));
      const Eigen::Matrix3d rotation = wrist.linear() * ExpSO3(turn);
      const Vector3d position = wrist * way;
      if (lone) {
        const Eigen::Matrix3d root_from_wrist =
            wrist.linear().transpose() * ExpSO3(Vector3d(pose.col(0)));
        pose.col(0) = LogSO3(rotation * root_from_wrist);
        clip.trans.col(t) += position - wrist.translation();
      } else {
        report.shortfall_m = std::max(
            report.shortfall_m, MoveWrist(rest, side, rotation, position, clip.trans.col(t), pose));
      }
      if (share < 1.0) continue;
      ++frames;
      report.wrist_moved_mean_m += way.norm();
      report.wrist_moved_max_m = std::max(report.wrist_moved_max_m, way.norm());
    }
  }
  if (frames > 0) report.wrist_moved_mean_m /= frames;
  return report;
}

}  // namespace holdfast
