// SPDX-License-Identifier: MIT
#include "solver/handover/hand_passage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/grasp/hand_approach.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kFree = 0.0007;     // metres: no deeper is clear
constexpr double kSoft = 0.002;      // metres that fingers give way to fingers
constexpr double kDepthCost = 30.0;  // metres of retreat that a metre of depth is worth
constexpr double kLeave = 8.0;       // m/s^2: no hand leaves faster
constexpr double kRetreatStep = 0.003;
constexpr int kRetreatSteps = 60;
constexpr double kBump_s = 0.17;   // half of the time in which a retreat comes and goes
constexpr double kClear = 0.0005;  // metres: a way that leaves no more is taken

// When what happens on the way out, in shares of `release_s` from the hold on: fingers are open;
// the wrist sets out from its place on the object; it is on the clip's own way.
struct Timing {
  double open, leave, home;
};
// From the quickest on; later ones where fingers that still hold the object would sweep through it.
constexpr std::array kTimings = {Timing{0.4, 0.2, 1.0}, Timing{0.4, 0.4, 1.2},
                                 Timing{0.7, 0.35, 1.4}, Timing{0.7, 0.7, 1.7},
                                 Timing{1.0, 0.8, 2.0}};

Isometry3d WristOf(const HandModel& hand, const JointPose& pose, const Vector3d& trans) {
  HandState state(hand);
  state.SetBody(pose, trans);
  return state.WorldFromWrist();
}

Isometry3d Between(const Isometry3d& a, const Isometry3d& b, double share) {
  const Eigen::Quaterniond turned =
      Eigen::Quaterniond(a.linear()).slerp(share, Eigen::Quaterniond(b.linear()));
  return RigidTransform(turned.toRotationMatrix(),
                        (1.0 - share) * a.translation() + share * b.translation());
}

// One frame of a passage.
struct PassageFrame {
  int t = 0;
  FingerPose fingers;
  Eigen::Matrix3Xd skin;         // wrist's frame
  Isometry3d object_from_wrist;  // without a retreat
  Eigen::Matrix3Xd balls;        // of the other hand's fingers, object's frame
  double retreat = 0.0;          // metres
};

// The way of one hand from the edge of its hold, frame `edge`, in the direction `step` of time.
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
        blend_(std::max(1, static_cast<int>(std::lround(release_s * clip.frame_rate)))),
        bump_(std::max(1, static_cast<int>(std::lround(kBump_s * clip.frame_rate)))) {}

  void Clear() {
    const int length = Length();
    if (length == 0) return;
    TakeGrasp();
    Way best;
    for (const Timing& timing : kTimings) {
      if (timing.home > 1.0 && Frames(timing.home) > length) continue;
      timing_ = timing;
      frames_.clear();
      for (int k = 1; k <= length; ++k) frames_.push_back(FrameAt(k));
      BetterWay(best);
      if (best.depth <= kClear) break;
    }
    line_ = best.line;
    for (const PassageFrame& frame : best.frames) Apply(frame);
  }

 private:
  struct Way {
    double cost = std::numeric_limits<double>::infinity();
    double depth = cost;  // most, metres
    Vector3d line = Vector3d::UnitZ();
    std::vector<PassageFrame> frames;
  };

  int Frames(double share) const { return static_cast<int>(std::lround(share * blend_)); }

  // That of frames_ along the best line, where it costs less.
  void BetterWay(Way& best) {
    const std::size_t out = std::min(frames_.size(), static_cast<std::size_t>(blend_)) - 1;
    const Vector3d away = frames_[out].object_from_wrist.translation() -
                          grasp_.wrist_from_object.inverse().translation();
    const Vector3d to_clip = away.norm() > 0.01 ? Vector3d(away.normalized()) : approach_.retreat;
    for (const Vector3d& line :
         {approach_.retreat, Vector3d((approach_.retreat + to_clip).normalized()), to_clip}) {
      const double cost = Retreat(line);
      if (!(cost < best.cost)) continue;
      best = {cost, 0.0, line, frames_};
      for (const PassageFrame& frame : frames_) {
        best.depth = std::max(best.depth, TooDeep(frame, line, frame.retreat));
      }
    }
  }

  bool Holds(int t) const { return (clip_.holding_hand[t] & HoldingBit(side_)) != 0; }

  // Frames without the hold, up to the middle of those before the next one.
  int Length() const {
    int free = 0;
    int t = edge_ + step_;
    while (t >= 0 && t < clip_.NumFrames() && !Holds(t) && free <= 4 * blend_) {
      ++free;
      t += step_;
    }
    const bool again = t >= 0 && t < clip_.NumFrames() && Holds(t);
    return std::min(2 * blend_, again ? free / 2 : free);
  }

  Isometry3d Object(int t) const { return clip_.object->Pose(t); }

  Eigen::Matrix3Xd SkinOf(const FingerPose& fingers) {
    Eigen::Matrix3Xd skin;
    SkinPositions(anatomy_.landmarks, evaluation_.At(fingers.data(), false).Vertices(), skin);
    return skin;
  }

  // Finger balls of the other hand in the object's frame.
  Eigen::Matrix3Xd OtherHand(int t) const {
    Eigen::Matrix3Xd centers(3, 0);
    if (other_ == nullptr) return centers;
    HandState state(other_->hand);
    state.SetBody(clip_.pose[t], clip_.trans.col(t));
    state.Evaluate(FingersOf(clip_.pose[t], other_->hand.HandSide()), false);
    BallCenters(other_->landmarks, state.Vertices(), centers);
    return Object(t).inverse() * centers;
  }

  void TakeGrasp() {
    grasp_.fingers = FingersOf(clip_.pose[edge_], side_);
    grasp_.wrist_from_object =
        WristOf(anatomy_.hand, clip_.pose[edge_], clip_.trans.col(edge_)).inverse() * Object(edge_);
    constexpr double kNoTable = -1e9;
    approach_ = FindApproach(anatomy_, grasp_, object_, kNoTable);
    PassageFrame held;
    held.skin = SkinOf(grasp_.fingers);
    held.object_from_wrist = grasp_.wrist_from_object.inverse();
    held.balls = OtherHand(edge_);
    own_ = {std::max(kFree, ObjectDepth(held, Vector3d::Zero())),
            std::max(kFree, HandDepth(held, Vector3d::Zero()))};
  }

  PassageFrame FrameAt(int k) {
    const int leave = Frames(timing_.leave);
    PassageFrame frame;
    frame.t = edge_ + step_ * k;
    const FingerPose own = FingersOf(source_.pose[frame.t], side_);
    const double opened = MinimumJerk(static_cast<double>(k) / (Opening() + 1));
    const double home =
        MinimumJerk(static_cast<double>(k - leave) / (Frames(timing_.home) + 1 - leave));
    frame.fingers = ClosingFingers(approach_, grasp_, 1.0 - opened);
    frame.fingers += home * (own - frame.fingers);
    frame.skin = SkinOf(frame.fingers);
    const Isometry3d from_world = Object(frame.t).inverse();
    frame.object_from_wrist = Between(
        grasp_.wrist_from_object.inverse(),
        from_world * WristOf(anatomy_.hand, source_.pose[frame.t], source_.trans.col(frame.t)),
        home);
    frame.balls = OtherHand(frame.t);
    return frame;
  }

  double ObjectDepth(const PassageFrame& frame, const Vector3d& shift) const {
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i < frame.skin.cols(); ++i) {
      const Vector3d x = frame.object_from_wrist * frame.skin.col(i) + shift;
      if ((x.array() < object_.Min().array()).any() || (x.array() > object_.Max().array()).any()) {
        continue;
      }
      least = std::min(least, object_.Distance(x));
    }
    return std::max(0.0, -least);
  }

  double HandDepth(const PassageFrame& frame, const Vector3d& shift) const {
    double deepest = 0.0;
    for (Eigen::Index b = 0; b < frame.balls.cols(); ++b) {
      const Vector3d center =
          frame.object_from_wrist.inverse() * Vector3d(frame.balls.col(b) - shift);
      const double radius = other_->landmarks.Balls()[b].radius;
      const double nearest = (frame.skin.colwise() - center).colwise().squaredNorm().minCoeff();
      deepest = std::max(deepest, radius - std::sqrt(nearest));
    }
    return deepest;
  }

  int Opening() const { return std::max(1, Frames(timing_.open)); }

  // How much deeper than in the hold itself, metres; other fingers are soft and give way.
  double TooDeep(const PassageFrame& frame, const Vector3d& line, double retreat) const {
    const Vector3d shift = retreat * line;
    const double depth = ObjectDepth(frame, shift) - own_.object;
    return std::max({0.0, depth, 0.5 * (HandDepth(frame, shift) - own_.hand - kSoft)});
  }

  // The least retreats along a line that clear all frames; what they cost.
  double Retreat(const Vector3d& line) {
    constexpr int kRounds = 3;
    for (PassageFrame& frame : frames_) frame.retreat = 0.0;
    for (int round = 0; round < kRounds; ++round) {
      bool clear = true;
      std::vector<double> needed(frames_.size());
      for (std::size_t k = 0; k < frames_.size(); ++k) {
        needed[k] = LeastRetreat(frames_[k], line);
        clear &= needed[k] == frames_[k].retreat;
      }
      if (clear) break;
      Smooth(needed);
    }
    double cost = 0.0;
    for (const PassageFrame& frame : frames_) {
      cost += frame.retreat + kDepthCost * TooDeep(frame, line, frame.retreat);
    }
    return cost;
  }

  // From the one it has on: what is worth its depth.
  double LeastRetreat(const PassageFrame& frame, const Vector3d& line) const {
    const double seconds = std::abs(frame.t - edge_) / clip_.frame_rate;
    const double most = 0.5 * kLeave * seconds * seconds;
    double best = frame.retreat, least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kRetreatSteps; ++i) {
      const double retreat = frame.retreat + kRetreatStep * i;
      if (i > 0 && retreat > most) break;
      const double depth = TooDeep(frame, line, retreat);
      const double cost = kDepthCost * depth + retreat;
      if (cost < least - 1e-9) {
        least = cost;
        best = retreat;
      }
      if (depth <= 0.0) break;
    }
    return best;
  }

  // No less than needed, rising and falling smoothly, zero in the hold.
  void Smooth(const std::vector<double>& needed) {
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      double most = needed[k];
      for (std::size_t j = 0; j < frames_.size(); ++j) {
        // While fingers open, the hand does not go because of what comes after.
        const int opening = Opening();
        const int from_hold = static_cast<int>(j) + 1;
        const double width =
            std::min(bump_, from_hold > opening ? from_hold - opening + 1 : from_hold);
        const double apart = std::abs(static_cast<double>(j) - static_cast<double>(k)) / width;
        if (apart >= 1.0) continue;
        most = std::max(most, 0.5 * needed[j] * (1.0 + std::cos(std::numbers::pi * apart)));
      }
      frames_[k].retreat = most;
    }
  }

  void Apply(const PassageFrame& frame) {
    const int t = frame.t;
    Isometry3d object_from_wrist = frame.object_from_wrist;
    object_from_wrist.translation() += frame.retreat * line_;
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

  struct Depth {
    double object = 0.0, hand = 0.0;
  };

  const Clip& source_;
  const HandAnatomy& anatomy_;
  const HandAnatomy* other_;
  const DistanceGrid& object_;
  Clip& clip_;
  Side side_;
  int edge_, step_, blend_, bump_;
  HandEvaluation evaluation_ = AtWrist(anatomy_.hand);
  Grasp grasp_;
  HandApproach approach_;
  Depth own_;
  Timing timing_ = kTimings[0];
  Vector3d line_ = Vector3d::UnitZ();
  std::vector<PassageFrame> frames_;
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
