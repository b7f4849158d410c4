// SPDX-License-Identifier: MIT
#include "generator/actions/action_strokes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "generator/body/pose_builder.h"
#include "generator/matching/body_frame.h"
#include "generator/nn/random_stream.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/body_model.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kThere = 0.75;    // fraction of the hand's maximum displacement
constexpr double kComes_s = 0.35;  // from the unchanged motion to the first stroke
constexpr double kTwoPi = 2.0 * std::numbers::pi;

// Frames with strokes.
struct Window {
  int begin = 0, end = 0;  // inclusive
  bool goes_on = false;    // the hand leaves again afterwards
  double period_s = 1.0, rate = 30.0;
  int strokes = 0;

  // Seconds since the beginning.
  double Time(int frame) const { return (frame - begin) / rate; }
  double Seconds() const { return (end - begin) / rate; }
};

// Right arm in one frame, world.
struct ArmAt {
  Vector3d shoulder, elbow;
  Isometry3d wrist;
};

ArmAt ArmOf(const Eigen::Matrix3Xd& rest_joints, const Clip& clip, int frame) {
  BodyState state;
  ForwardJoints(rest_joints, clip.pose[static_cast<std::size_t>(frame)], clip.trans.col(frame),
                state);
  return {state.joints.col(kRightShoulder), state.joints.col(kRightElbow),
          state.WorldFromJoint(kRightWrist)};
}

// Hand displacement relative to the chest, normalized to 0..1.
std::vector<double> WayGone(const Eigen::Matrix3Xd& rest_joints, const Clip& clip, int count) {
  std::vector<Vector3d> hands;
  for (int t = 0; t < count; ++t) {
    BodyState state;
    ForwardJoints(rest_joints, clip.pose[static_cast<std::size_t>(t)], clip.trans.col(t), state);
    hands.push_back(state.WorldFromJoint(kSpine3).inverse() * state.joints.col(kRightWrist));
  }
  double farthest = 0.05;  // meters
  for (const Vector3d& hand : hands) farthest = std::max(farthest, (hand - hands[0]).norm());
  std::vector<double> gone;
  for (const Vector3d& hand : hands) gone.push_back((hand - hands[0]).norm() / farthest);
  return gone;
}

std::optional<Window> WindowOf(const Eigen::Matrix3Xd& rest_joints, const Clip& clip, int count,
                               double period_s) {
  const std::vector<double> gone = WayGone(rest_joints, clip, count);
  const auto there = [](double share) { return share >= kThere; };
  const auto first = std::ranges::find_if(gone, there);
  if (first == gone.end()) return std::nullopt;
  Window window;
  window.rate = clip.frame_rate;
  window.begin = static_cast<int>(first - gone.begin());
  window.end = window.begin;
  for (int t = window.begin; t < count; ++t)
    window.end = there(gone[static_cast<std::size_t>(t)]) ? t : window.end;
  window.goes_on = window.end + 1 < clip.NumFrames();
  // Uses at least two strokes if they need not be much faster for it.
  const double periods = (window.Seconds() - kComes_s) / period_s;
  window.strokes = static_cast<int>(std::lround(std::max(periods, periods > 1.3 ? 2.0 : 0.0)));
  if (window.strokes < 1) return std::nullopt;
  window.period_s = (window.Seconds() - kComes_s) / window.strokes;
  return window;
}

// Weight of the strokes: 0 before the window, 1 in it; fades out if the hand leaves.
double Presence(const Window& window, int frame) {
  const double in = (window.Time(frame) + 0.5 * kComes_s) / (1.5 * kComes_s);
  const double out = window.goes_on ? (window.end - frame) / window.rate / kComes_s + 1.0 : 1.0;
  return MinimumJerk(std::clamp(in, 0.0, 1.0)) * MinimumJerk(std::clamp(out, 0.0, 1.0));
}

// Profile of a blow: 0 struck, 1 raised. Rises slowly, stops, falls faster and faster, rebounds.
double Raised(double phase) {
  phase -= std::floor(phase);
  if (phase < 0.5) return MinimumJerk(phase / 0.5);
  if (phase < 0.58) return 1.0;
  if (phase < 0.78) {
    const double down = (phase - 0.58) / 0.2;
    return 1.0 - down * down;
  }
  const double after = (phase - 0.78) / 0.22;
  return 0.07 * std::sin(std::numbers::pi * after) * (1.0 - after);
}

// After a change of a frame's arm, which was as in `before`: the object follows the wrist, which
// was at `from`.
void Follow(int frame, const JointPose& before, const Isometry3d& from, const Isometry3d& to,
            Clip& clip) {
  JointPose& pose = clip.pose[static_cast<std::size_t>(frame)];
  for (const int joint : {kRightShoulder, kRightElbow, kRightWrist}) {
    pose.col(joint) = UnwrapAxisAngle(pose.col(joint), before.col(joint));
  }
  clip.object->SetPose(frame, to * from.inverse() * clip.object->Pose(frame));
}

void MoveHand(const Eigen::Matrix3Xd& rest_joints, int frame, const Isometry3d& from,
              const Isometry3d& to, Clip& clip) {
  JointPose& pose = clip.pose[static_cast<std::size_t>(frame)];
  const JointPose before = pose;
  MoveWrist(rest_joints, Side::kRight, to.linear(), to.translation(), clip.trans.col(frame), pose);
  Follow(frame, before, from, to, clip);
}

void SetArm(const Eigen::Matrix3Xd& rest_joints, int frame, const JointPose& pose, Clip& clip) {
  const JointPose before = clip.pose[static_cast<std::size_t>(frame)];
  const Isometry3d from = ArmOf(rest_joints, clip, frame).wrist;
  clip.pose[static_cast<std::size_t>(frame)] = pose;
  Follow(frame, before, from, ArmOf(rest_joints, clip, frame).wrist, clip);
}

// Removes periodic arm motion in the window: each frame is replaced by the mean of the period
// around it.
void CalmArm(const Eigen::Matrix3Xd& rest_joints, const Window& window, Clip& clip) {
  const std::vector<JointPose> before = clip.pose;
  const int half = static_cast<int>(std::lround(0.5 * window.period_s * window.rate));
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const double presence = Presence(window, t);
    if (presence <= 0.0) continue;
    const int at = std::clamp(t, window.begin, window.end);
    const int first = std::max(window.begin, at - half), last = std::min(window.end, at + half);
    JointPose pose = before[static_cast<std::size_t>(t)];
    for (const int joint : {kRightShoulder, kRightElbow, kRightWrist}) {
      const Matrix3d now = ExpSO3(pose.col(joint));
      Vector3d mean = Vector3d::Zero();
      for (int k = first; k <= last; ++k)
        mean += LogSO3(now.transpose() * ExpSO3(before[static_cast<std::size_t>(k)].col(joint)));
      mean /= last - first + 1;
      pose.col(joint) = LogSO3(now * ExpSO3(presence * mean));
    }
    SetArm(rest_joints, t, pose, clip);
  }
}

// Mean direction and rotation of the hammer before strokes are added.
struct Aim {
  Vector3d axis;           // rotation axis of the rise, world, unit
  double elevation = 0.0;  // of the handle, in the plane normal to `axis`, radians
  double roll = 0.0;       // of the face out of that plane, about the handle
};

Aim AimOf(const Clip& clip, const ObjectMarks& marks, const Window& window) {
  Vector3d forward = Vector3d::Zero(), facing = Vector3d::Zero();
  const int later = window.begin + (window.end - window.begin) / 3;  // after arrival
  for (int t = later; t <= window.end; ++t) {
    const Matrix3d R = clip.object->Pose(t).linear();
    forward += R * marks.forward;
    facing += R * marks.facing;
  }
  forward.normalize();
  Vector3d ahead = forward + facing.normalized();
  ahead.z() = 0.0;
  if (ahead.norm() < 0.2) ahead = Vector3d(forward.x(), forward.y(), 0.0);
  ahead.normalize();
  Aim aim;
  aim.axis = ahead.cross(Vector3d::UnitZ());
  aim.elevation = std::atan2(forward.z(), forward.dot(ahead));
  const Vector3d down = aim.axis.cross(forward).normalized() * -1.0;  // target face direction
  aim.roll = std::atan2(forward.dot(down.cross(facing)), down.dot(facing));
  return aim;
}

void AddBlows(const Eigen::Matrix3Xd& rest_joints, const ObjectMarks& marks, const Window& window,
              RandomDraws& draws, Clip& clip) {
  CalmArm(rest_joints, window, clip);
  const Aim aim = AimOf(clip, marks, window);
  const auto degrees = [&](double low, double high) { return kDegree * draws.Uniform(low, high); };
  // Rotation of shoulder, elbow and wrist relative to the calmed motion, struck and raised.
  const double struck[3] = {-degrees(4.0, 10.0), -degrees(20.0, 28.0), 0.0};
  const double raised[3] = {degrees(6.0, 14.0), degrees(14.0, 22.0), 0.0};
  const auto wrist = [&](double elevation, double arm) {
    return std::clamp(elevation - aim.elevation - arm, -35.0 * kDegree, 35.0 * kDegree);
  };
  const double struck_wrist = wrist(degrees(-5.0, 10.0), struck[0] + struck[1]);
  const double raised_wrist = wrist(degrees(80.0, 100.0), raised[0] + raised[1]);
  const double straighten = std::clamp(-aim.roll, -25.0 * kDegree, 25.0 * kDegree);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const double presence = Presence(window, t);
    if (presence <= 0.0) continue;
    const double time = std::clamp(window.Time(t) - kComes_s, 0.0, window.Seconds() - kComes_s);
    const double phase = time / window.period_s;
    const double arm = phase >= window.strokes ? 0.0 : Raised(phase);
    const double late = phase >= window.strokes ? 0.0 : Raised(std::max(0.0, phase - 0.04));
    const auto turn = [&](double low, double high, double up) {
      return AngleAxisd(presence * (low + up * (high - low)), aim.axis).toRotationMatrix();
    };
    const ArmAt at = ArmOf(rest_joints, clip, t);
    const Matrix3d from_shoulder = turn(struck[0], raised[0], arm);
    const Matrix3d from_elbow = from_shoulder * turn(struck[1], raised[1], arm);
    Isometry3d to = at.wrist;
    to.translation() = at.shoulder + from_shoulder * (at.elbow - at.shoulder) +
                       from_elbow * (at.wrist.translation() - at.elbow);
    const Vector3d handle = clip.object->Pose(t).linear() * marks.forward;
    to.linear() = from_elbow * turn(struck_wrist, raised_wrist, late) *
                  AngleAxisd(presence * straighten, handle).toRotationMatrix() * at.wrist.linear();
    MoveHand(rest_joints, t, at.wrist, to, clip);
  }
}

void AddSwings(const Eigen::Matrix3Xd& rest_joints, std::string_view action,
               const ObjectMarks& marks, const Window& window, RandomDraws& draws, Clip& clip) {
  const int middle = (window.begin + window.end) / 2;
  // Back-and-forth motion: sine along one direction, cosine along another, meters, world.
  Vector3d along = Vector3d::Zero(), aside = Vector3d::Zero();
  const Matrix3d object = clip.object->Pose(middle).linear();
  if (action == "shake") {
    along = draws.Uniform(0.025, 0.05) * Vector3d::UnitZ();
  } else if (action == "chop") {
    along = draws.Uniform(0.018, 0.035) * Vector3d::UnitZ();
  } else if (action == "brush") {
    along = draws.Uniform(0.009, 0.017) * (object * marks.forward);
  } else {  // cook
    Vector3d ahead = object * marks.forward;
    ahead.z() = 0.0;
    ahead.normalize();
    along = draws.Uniform(0.025, 0.05) * ahead;
    aside = draws.Uniform(0.0, 0.035) * Vector3d::UnitZ().cross(ahead);
  }
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const double presence = Presence(window, t);
    if (presence <= 0.0) continue;
    const double phase = kTwoPi * window.Time(t) / window.period_s;
    const ArmAt at = ArmOf(rest_joints, clip, t);
    Isometry3d to = at.wrist;
    to.translation() += presence * (std::sin(phase) * along + (std::cos(phase) - 1.0) * aside);
    MoveHand(rest_joints, t, at.wrist, to, clip);
  }
}

void AddTurns(const Eigen::Matrix3Xd& rest_joints, const Window& window, RandomDraws& draws,
              Clip& clip) {
  const double width = kDegree * draws.Uniform(22.0, 38.0);
  const Vector3d along = (rest_joints.col(kRightWrist) - rest_joints.col(kRightElbow)).normalized();
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const double presence = Presence(window, t);
    if (presence <= 0.0) continue;
    // The twist about the forearm is split equally between elbow and wrist, as real skin does.
    const double angle = presence * width * std::sin(kTwoPi * window.Time(t) / window.period_s);
    const Matrix3d half = AngleAxisd(0.5 * angle, along).toRotationMatrix();
    JointPose pose = clip.pose[static_cast<std::size_t>(t)];
    pose.col(kRightElbow) = LogSO3(ExpSO3(pose.col(kRightElbow)) * half);
    pose.col(kRightWrist) = LogSO3(half * ExpSO3(pose.col(kRightWrist)));
    SetArm(rest_joints, t, pose, clip);
  }
}

// Seconds; 0 for an action without strokes. As in the scripts, except for turns, which are slower
// so that key frames can follow.
double PeriodOf(std::string_view action, RandomDraws& draws) {
  if (action == "use") return draws.Uniform(0.8, 1.0);
  if (action == "shake") return draws.Uniform(0.27, 0.42);
  if (action == "chop") return draws.Uniform(0.38, 0.6);
  if (action == "cook") return draws.Uniform(0.75, 1.15);
  if (action == "brush") return draws.Uniform(0.26, 0.42);
  if (action == "inspect") return draws.Uniform(1.4, 2.2);
  return 0.0;
}

}  // namespace

void AddStrokes(const Eigen::Matrix3Xd& rest_joints, std::string_view action,
                const ObjectMarks& marks, std::uint64_t seed, int count, Clip& clip) {
  RandomDraws draws(seed);
  const double period_s = PeriodOf(action, draws);
  if (period_s == 0.0 || !clip.object || count < 2) return;
  const std::optional<Window> window = WindowOf(rest_joints, clip, count, period_s);
  if (!window) return;
  if (action == "use") {
    AddBlows(rest_joints, marks, *window, draws, clip);
  } else if (action == "inspect") {
    AddTurns(rest_joints, *window, draws, clip);
  } else {
    AddSwings(rest_joints, action, marks, *window, draws, clip);
  }
}

}  // namespace holdfast
