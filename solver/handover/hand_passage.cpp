// SPDX-License-Identifier: MIT
#include "solver/handover/hand_passage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/grasp/hand_approach.h"
#include "solver/handover/grasps_by_transfer.h"
#include "solver/handover/passage_clearance.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kClear = 0.0005;  // meters: a path with at most this depth is accepted
// Meters of retreat per meter of further depth: shorter paths are not traded for depth.
constexpr double kNotClear = 1000.0;
constexpr double kRounding = 1e-5;
constexpr double kEased = 0.0002;  // meters: allowed depth after easing, unless the path has more

// Timing of the path, in fractions of `release_s` from the hold on: fingers are open; the wrist
// leaves its place on the object; the wrist is on the clip's path.
struct Timing {
  double open, leave, home;
};
// Fastest first; later ones for fingers that would sweep through the object while leaving it.
constexpr std::array kTimings = {Timing{0.4, 0.2, 1.0}, Timing{0.4, 0.4, 1.2},
                                 Timing{0.7, 0.35, 1.4}, Timing{0.7, 0.7, 1.7},
                                 Timing{1.0, 0.8, 2.0}};

Isometry3d Between(const Isometry3d& a, const Isometry3d& b, double share) {
  const Eigen::Quaterniond turned =
      Eigen::Quaterniond(a.linear()).slerp(share, Eigen::Quaterniond(b.linear()));
  return RigidTransform(turned.toRotationMatrix(),
                        (1.0 - share) * a.translation() + share * b.translation());
}

// Path of one hand from the edge of its hold, frame `edge`, in the time direction `step`.
class Passage {
 public:
  Passage(const Clip& source, const HandAnatomy& anatomy, const HandAnatomy* other,
          const DistanceGrid& object, double release_s, int edge, int step, Clip& clip)
      : source_(source),
        anatomy_(anatomy),
        other_(other),
        object_(object),
        clip_(clip),
        side_(anatomy.hand.HandSide()),
        edge_(edge),
        step_(step),
        blend_(std::max(1, static_cast<int>(std::lround(release_s * clip.frame_rate)))) {}

  void Clear() {
    const int most = Free();
    int length = std::min(2 * blend_, most);
    if (length == 0) return;
    TakeGrasp();
    // A hand that rests where the object stands stays clear for as long.
    while (length < most && ExceedsPenetration(length + 1)) ++length;
    Way best;
    for (const Timing& timing : kTimings) {
      if (timing.home > 1.0 && Frames(timing.home) > length) continue;
      Keep(timing, Lines(timing, length), length, best);
      if (best.depth <= kClear) break;
    }
    if (best.depth > kClear) Keep(best.timing, Detours(), length, best);
    if (best.depth > kClear) Keep(kTimings.back(), Detours(), length, best);
    Ease(best);
  }

 private:
  struct Way {
    double cost = std::numeric_limits<double>::infinity();
    double depth = cost;  // maximum, meters
    Timing timing = kTimings.front();
    Vector3d line = Vector3d::UnitZ();
    std::vector<PassageFrame> frames;
  };

  int Frames(double share) const { return static_cast<int>(std::lround(share * blend_)); }
  int Opening(const Timing& timing) const { return std::max(1, Frames(timing.open)); }

  std::vector<PassageFrame> FramesOf(const Timing& timing, int length) {
    std::vector<PassageFrame> frames;
    for (int k = 1; k <= length; ++k) frames.push_back(FrameAt(k, timing));
    return frames;
  }

  // Lines away from the object: that of FindApproach, that to the clip's wrist, and their mean.
  std::vector<Vector3d> Lines(const Timing& timing, int length) {
    const PassageFrame out = FrameAt(std::min(length, blend_), timing);
    const Vector3d away =
        out.object_from_wrist.translation() - grasp_.wrist_from_object.inverse().translation();
    const Vector3d to_clip = away.norm() > 0.01 ? Vector3d(away.normalized()) : approach_.retreat;
    return {approach_.retreat, Vector3d((approach_.retreat + to_clip).normalized()), to_clip};
  }

  // Other lines, in two cones around the first.
  std::vector<Vector3d> Detours() const {
    constexpr int kAround = 8;
    const Vector3d beside = approach_.retreat.unitOrthogonal();
    const Vector3d across = approach_.retreat.cross(beside);
    std::vector<Vector3d> lines;
    for (const double tilt : {40.0 * kDegree, 80.0 * kDegree}) {
      for (int k = 0; k < kAround; ++k) {
        const double turn = 2.0 * std::numbers::pi * k / kAround;
        lines.emplace_back(std::cos(tilt) * approach_.retreat +
                           std::sin(tilt) * (std::cos(turn) * beside + std::sin(turn) * across));
      }
    }
    return lines;
  }

  // Keeps the best of these paths if its cost is lower.
  void Keep(const Timing& timing, const std::vector<Vector3d>& lines, int length, Way& best) {
    std::vector<PassageFrame> frames = FramesOf(timing, length);
    for (const Vector3d& line : lines) {
      const double cost = clearance_->Retreat(line, Opening(timing), frames);
      if (!(cost < best.cost)) continue;
      double depth = 0.0;
      for (const PassageFrame& frame : frames) {
        depth = std::max(depth, clearance_->TooDeep(frame, frame.retreat * line));
      }
      const double whole = cost + kNotClear * std::max(0.0, depth - kClear);
      if (whole < best.cost) best = {whole, depth, timing, line, frames};
    }
  }

  std::optional<Vector3d> OwnWrist(int t) const {
    if (t < 0 || t >= clip_.NumFrames()) return std::nullopt;
    return WristIn(anatomy_.hand, clip_.pose[t], clip_.trans.col(t)).translation();
  }

  // Applies the path with as little acceleration as the obstacles allow.
  void Ease(const Way& best) {
    const auto count = static_cast<int>(best.frames.size());
    Eigen::Matrix3Xd way(3, count);
    std::vector<double> allowed;
    for (int k = 0; k < count; ++k) {
      const PassageFrame& frame = best.frames[k];
      const Vector3d shift = frame.retreat * best.line;
      way.col(k) = Object(frame.t) * Vector3d(frame.object_from_wrist.translation() + shift);
      allowed.push_back(std::max(kEased, clearance_->TooDeep(frame, shift)));
    }
    const auto shift_to = [&](int k, const Vector3d& wrist) -> Vector3d {
      const PassageFrame& frame = best.frames[k];
      return Object(frame.t).inverse() * wrist - frame.object_from_wrist.translation();
    };
    const int end = edge_ + step_ * count;
    const Eigen::Matrix3Xd eased = EasedWay(
        way,
        {OwnWrist(edge_ - step_), OwnWrist(edge_), OwnWrist(end + step_),
         OwnWrist(end + 2 * step_)},
        [&](int k, const Vector3d& wrist) {
          return clearance_->TooDeep(best.frames[k], shift_to(k, wrist)) <= allowed[k] + kRounding;
        });
    for (int k = 0; k < count; ++k) Apply(best.frames[k], shift_to(k, eased.col(k)));
  }

  bool Holds(int t) const { return (clip_.holding_hand[t] & HoldingBit(side_)) != 0; }

  // Number of frames without a hold, up to the middle of the interval before the next one.
  int Free() const {
    int free = 0;
    int t = edge_ + step_;
    while (t >= 0 && t < clip_.NumFrames() && !Holds(t)) {
      ++free;
      t += step_;
    }
    const bool again = t >= 0 && t < clip_.NumFrames();
    return again ? free / 2 : free;
  }

  // On the clip's own path.
  bool ExceedsPenetration(int k) {
    return clearance_->TooDeep(FrameAt(k, kTimings.back()), Vector3d::Zero()) > kClear;
  }

  Isometry3d Object(int t) const { return clip_.object->Pose(t); }

  Eigen::Matrix3Xd SkinOf(const FingerPose& fingers) {
    Eigen::Matrix3Xd skin;
    SkinPositions(anatomy_.landmarks, evaluation_.At(fingers.data(), false).Vertices(), skin);
    return skin;
  }

  // The other hand's balls in the object frame.
  Eigen::Matrix4Xd OtherHand(int t) const {
    if (other_ == nullptr) return {};
    const FingerPose fingers = FingersOf(clip_.pose[t], other_->hand.HandSide());
    return MovedBalls(
        Object(t).inverse() * WristIn(other_->hand, clip_.pose[t], clip_.trans.col(t)),
        HandBalls(*other_, fingers));
  }

  void TakeGrasp() {
    grasp_.fingers = FingersOf(clip_.pose[edge_], side_);
    grasp_.wrist_from_object =
        WristIn(anatomy_.hand, clip_.pose[edge_], clip_.trans.col(edge_)).inverse() * Object(edge_);
    constexpr double kNoTable = -1e9;
    approach_ = FindApproach(anatomy_, grasp_, object_, kNoTable);
    clearance_.emplace(anatomy_, object_,
                       At(edge_, grasp_.fingers, grasp_.wrist_from_object.inverse()),
                       clip_.frame_rate);
  }

  PassageFrame At(int t, const FingerPose& fingers, const Isometry3d& object_from_wrist) {
    PassageFrame frame;
    frame.t = t;
    frame.fingers = fingers;
    frame.skin = SkinOf(fingers);
    frame.balls = HandBalls(anatomy_, fingers);
    frame.object_from_wrist = object_from_wrist;
    frame.other = OtherHand(t);
    return frame;
  }

  PassageFrame FrameAt(int k, const Timing& timing) {
    const int leave = Frames(timing.leave);
    const int t = edge_ + step_ * k;
    const FingerPose own = FingersOf(source_.pose[t], side_);
    const double opened = MinimumJerk(static_cast<double>(k) / (Opening(timing) + 1));
    const double home =
        MinimumJerk(static_cast<double>(k - leave) / (Frames(timing.home) + 1 - leave));
    FingerPose fingers = ClosingFingers(approach_, grasp_, 1.0 - opened);
    fingers += home * (own - fingers);
    const Isometry3d from_world = Object(t).inverse();
    return At(
        t, fingers,
        Between(grasp_.wrist_from_object.inverse(),
                from_world * WristIn(anatomy_.hand, source_.pose[t], source_.trans.col(t)), home));
  }

  void Apply(const PassageFrame& frame, const Vector3d& shift) {
    const int t = frame.t;
    Isometry3d object_from_wrist = frame.object_from_wrist;
    object_from_wrist.translation() += shift;
    JointPose& pose = clip_.pose[t];
    if (anatomy_.hand.Surface().Model().LoneHand()) {
      pose.col(0) = source_.pose[t].col(0);
      clip_.trans.col(t) = source_.trans.col(t);
    } else {
      for (int j = WristJoint(side_), n = 0; n < 3; ++n, j = kJointParents[j]) {
        pose.col(j) = source_.pose[t].col(j);
      }
    }
    const Isometry3d wrist = Object(t) * object_from_wrist;
    const Vector3d trans = clip_.trans.col(t);
    MoveHand(anatomy_.hand, OffsetTo(anatomy_.hand, wrist, trans, pose), clip_.trans.col(t), pose);
    SetFingers(pose, side_, frame.fingers);
  }

  const Clip& source_;
  const HandAnatomy& anatomy_;
  const HandAnatomy* other_;
  const DistanceGrid& object_;
  Clip& clip_;
  Side side_;
  int edge_, step_, blend_;
  HandEvaluation evaluation_ = AtWrist(anatomy_.hand);
  Grasp grasp_;
  HandApproach approach_;
  std::optional<PassageClearance> clearance_;
};

}  // namespace

void ClearPassages(const Clip& source, std::span<const HandModel* const> hands,
                   const DistanceGrid& object, double release_s, Clip& clip) {
  std::vector<HandAnatomy> anatomies;
  anatomies.reserve(hands.size());
  for (const HandModel* hand : hands) anatomies.emplace_back(*hand);
  for (std::size_t h = 0; h < hands.size(); ++h) {
    const std::uint8_t bit = HoldingBit(hands[h]->HandSide());
    const HandAnatomy* other = hands.size() > 1 ? &anatomies[1 - h] : nullptr;
    for (int t = 1; t < clip.NumFrames(); ++t) {
      const bool held = (clip.holding_hand[t] & bit) != 0;
      if (held == ((clip.holding_hand[t - 1] & bit) != 0)) continue;
      Passage(source, anatomies[h], other, object, release_s, held ? t : t - 1, held ? -1 : 1, clip)
          .Clear();
    }
  }
}

}  // namespace holdfast
