// SPDX-License-Identifier: MIT
#include "solver/actions/captured_brush.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/rotation.h"
#include "solver/carry/first_grasp.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kGiveWay_s = 0.6;
constexpr double kSmooth_s = 0.1;  // smoothing of the bristles' path over the head
constexpr double kOffSkin_m = 0.001;
constexpr int kLooks = 7;  // frames sampled to rate a candidate
constexpr int kSkinOfHand = 6;

// Grasp and orientation of the brush on the head.
struct BrushWay {
  const Grasp* grasp = nullptr;
  double turn_rad = 0.0;  // about the skin normal
  double tilt_rad = 0.0;  // of the handle off the head
};

double Squared(double x) { return x * x; }

Isometry3d JointInWorld(const Matrix3Xd& rest_joints, const Clip& clip, int t, int joint) {
  BodyState state;
  ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
  return state.WorldFromJoint(joint);
}

class BrushServer {
 public:
  BrushServer(const ActionActor& actor, const ActionProp& brush, Side side, int begin, int end,
              Clip& clip)
      : actor_(actor),
        brush_(brush),
        rest_(actor.Measures().rest_joints),
        side_(side),
        begin_(begin),
        end_(end),
        clip_(clip),
        head_(actor.Face().head) {
    FindWay();
  }

  const Grasp* Serve(std::span<const Grasp> grasps) {
    BrushWay best;
    double least = 0.0;
    for (const Grasp& grasp : grasps) {
      const Matrix3Xd skin = SkinInWrist(actor_.Hand(side_), grasp.fingers, kSkinOfHand);
      for (const double turn : {0.0, 35.0, -35.0, 70.0, -70.0}) {
        for (const double tilt : {0.0, 20.0, 40.0}) {
          const BrushWay way{&grasp, turn * kDegree, tilt * kDegree};
          const double cost = CostOf(way, skin);
          if (best.grasp != nullptr && cost >= least) continue;
          least = cost;
          best = way;
        }
      }
    }
    if (best.grasp != nullptr) Move(best);
    return best.grasp;
  }

 private:
  Isometry3d InWorld(int t, int joint) const { return JointInWorld(rest_, clip_, t, joint); }

  // Path of the bristles and skin normals along it: head frame, smoothed over time.
  void FindWay() {
    const int count = end_ - begin_;
    Matrix3Xd at(3, count), normal(3, count);
    for (int k = 0; k < count; ++k) {
      const Isometry3d wrist = InWorld(begin_ + k, WristJoint(side_));
      const auto near = head_.Query(InWorld(begin_ + k, kHead).inverse() * PalmOf(side_, wrist));
      at.col(k) = near.closest;
      normal.col(k) = near.gradient;
    }
    at_.resize(3, count);
    normal_.resize(3, count);
    const double sigma = kSmooth_s * clip_.frame_rate;
    for (int k = 0; k < count; ++k) {
      Vector3d mean = Vector3d::Zero(), up = Vector3d::Zero();
      double sum = 0.0;
      for (int i = 0; i < count; ++i) {
        const double weight = std::exp(-0.5 * Squared((i - k) / sigma));
        mean += weight * at.col(i);
        up += weight * normal.col(i);
        sum += weight;
      }
      const auto near = head_.Query(mean / sum);
      normal_.col(k) = up.normalized();
      at_.col(k) = near.closest + kOffSkin_m * normal_.col(k);
    }
  }

  // Returns the wrist pose that places the brush on the head in frame begin_ + k, near `wrist`.
  Isometry3d WristFor(const BrushWay& way, int k, const Isometry3d& head,
                      const Isometry3d& wrist) const {
    const Vector3d normal = head.linear() * normal_.col(k);
    const Isometry3d held = wrist * way.grasp->wrist_from_object;
    Matrix3d R = RotationBetween(held.linear() * brush_.marks.facing, -normal).toRotationMatrix() *
                 held.linear();
    R = ExpSO3(way.turn_rad * normal) * R;
    const Vector3d handle = -R * brush_.marks.forward;
    R = ExpSO3(way.tilt_rad * handle.cross(normal).normalized()) * R;
    return PoseAt(R, brush_.marks.tip, head * Vector3d(at_.col(k))) *
           way.grasp->wrist_from_object.inverse();
  }

  double CostOf(const BrushWay& way, const Matrix3Xd& skin) const {
    const int count = end_ - begin_;
    double cost = -0.5 * way.grasp->score;
    for (int look = 0; look < kLooks; ++look) {
      const int k = (count - 1) * look / (kLooks - 1), t = begin_ + k;
      const Isometry3d head = InWorld(t, kHead), was = InWorld(t, WristJoint(side_));
      const Isometry3d wrist = WristFor(way, k, head, was);
      JointPose pose = clip_.pose[t];
      const double missing =
          MoveWrist(rest_, side_, wrist.linear(), wrist.translation(), clip_.trans.col(t), pose);
      const double bent = pose.col(WristJoint(side_)).norm();
      const Isometry3d head_from_wrist = head.inverse() * wrist;
      const double clear =
          std::min(Nearest(head_from_wrist, skin),
                   Nearest(head_from_wrist * way.grasp->wrist_from_object, brush_.samples) + 0.002);
      cost += (Squared((wrist.translation() - was.translation()).norm() / 0.08) +
               Squared(AngleBetween(wrist.linear(), was.linear()) / (40.0 * kDegree)) +
               Squared(missing / 0.005) +
               Squared(std::max(0.0, bent - 70.0 * kDegree) / (10.0 * kDegree)) +
               Squared(std::max(0.0, 0.002 - clear) / 0.002)) /
              kLooks;
    }
    return cost;
  }

  // Minimum distance of points, fixed to the head's frame by the given pose, from its skin.
  double Nearest(const Isometry3d& head_from_points, const Matrix3Xd& points) const {
    double nearest = 1e9;
    const DistanceGrid& head = actor_.Head();
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Vector3d p = head_from_points * points.col(i);
      if ((p.array() < head.Min().array()).any() || (p.array() > head.Max().array()).any()) {
        continue;
      }
      nearest = std::min(nearest, head.Distance(p));
    }
    return nearest;
  }

  void Move(const BrushWay& way) {
    const int frames = clip_.NumFrames(), last = end_ - begin_ - 1;
    const double give_way = kGiveWay_s * clip_.frame_rate;
    // Wrist displacement and rotation while it is over the head.
    std::vector<Vector3d> shift, turn;
    for (int k = 0; k <= last; ++k) {
      const Isometry3d was = InWorld(begin_ + k, WristJoint(side_));
      const Isometry3d is = WristFor(way, k, InWorld(begin_ + k, kHead), was);
      shift.push_back(is.translation() - was.translation());
      turn.push_back(LogSO3(is.linear() * was.linear().transpose()));
    }
    clip_.object.emplace();
    clip_.object->trans.setZero(3, frames);
    clip_.object->orient.setZero(3, frames);
    clip_.holding_hand.assign(static_cast<std::size_t>(frames), HoldingBit(side_));
    for (int t = 0; t < frames; ++t) {
      const auto k = static_cast<std::size_t>(std::clamp(t - begin_, 0, last));
      const int off = std::max({0, begin_ - t, t - (end_ - 1)});
      const double share = 1.0 - MinimumJerk(off / give_way);
      JointPose& pose = clip_.pose[t];
      const Isometry3d was = InWorld(t, WristJoint(side_));
      if (share > 0.0) {
        MoveWrist(rest_, side_, ExpSO3(share * turn[k]) * was.linear(),
                  was.translation() + share * shift[k], clip_.trans.col(t), pose);
      }
      SetFingers(pose, side_, way.grasp->fingers);
      clip_.object->SetPose(t, InWorld(t, WristJoint(side_)) * way.grasp->wrist_from_object);
    }
  }

  const ActionActor& actor_;
  const ActionProp& brush_;
  const Matrix3Xd& rest_;
  Side side_;
  int begin_, end_;
  Clip& clip_;
  SignedDistance head_;
  Matrix3Xd at_, normal_;
};

}  // namespace

const Grasp* ServeBrush(const ActionActor& actor, const ActionProp& brush,
                        std::span<const Grasp> grasps, Side side, int begin, int end, Clip& clip) {
  return BrushServer(actor, brush, side, begin, end, clip).Serve(grasps);
}

double BristlesFromHead(const ActionActor& actor, const ObjectMarks& brush, const Clip& clip,
                        int frame) {
  const Vector3d bristles = clip.object->Pose(frame) * brush.tip;
  const Isometry3d head = JointInWorld(actor.Measures().rest_joints, clip, frame, kHead);
  return SignedDistance(actor.Face().head).Distance(head.inverse() * bristles);
}

}  // namespace holdfast
