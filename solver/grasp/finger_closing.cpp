// SPDX-License-Identifier: MIT
#include "solver/grasp/finger_closing.h"
#include "geometry/rotation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace holdfast {
namespace {

// Relative joint speeds of a finger while it closes.
constexpr double kFingerSpeed[3] = {1.0, 1.0, 0.67};
constexpr double kThumbSpeed[3] = {0.6, 0.7, 0.8};
constexpr double kClosingStep = 0.035;    // radians near the object, more elsewhere
constexpr double kClosingTouch = 0.0006;  // contact threshold, meters

double Speed(int joint) {
  return joint / 3 == kThumb ? kThumbSpeed[joint % 3] : kFingerSpeed[joint % 3];
}

// Closes one hand on one object; holds the data used in every step.
class FingerCloser {
 public:
  FingerCloser(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
               const Eigen::Isometry3d& wrist_from_object,
               const std::array<bool, kNumFingers>& fingers, double allowed_depth)
      : axes_(anatomy.axes),
        landmarks_(anatomy.landmarks),
        hand_(hand),
        object_(object),
        wrist_from_object_(wrist_from_object),
        object_from_wrist_(wrist_from_object.inverse()),
        fingers_(fingers),
        allowed_depth_(allowed_depth) {
    for (const HandLandmarks::BallPair& pair : landmarks_.BallPairs()) {
      const int a = landmarks_.Balls()[pair.first].finger_joint / 3;
      const int b = landmarks_.Balls()[pair.second].finger_joint / 3;
      if (a != kThumb && b != kThumb) continue;
      meeting_thumb_[a].push_back(pair);
      meeting_thumb_[b].push_back(pair);
    }
  }

  Closing Close(const HandAngles& start) {
    Closing closing{start, {}, {}};
    std::array<bool, kNumFingers> moving = fingers_;
    moving[kThumb] = false;
    Bend(closing, moving);
    if (fingers_[kThumb]) closing = BringThumb(closing, start);

    for (int finger = 0; finger < kNumFingers; ++finger) {
      for (int j = 0; j < 3; ++j) {
        closing.finger_touching[finger] |= closing.touching[3 * finger + j];
      }
    }
    RestIdleFingers(closing);
    if (!closing.finger_touching[kThumb] && fingers_[kThumb]) {
      // Rests at most where it stopped, halfway otherwise.
      closing.angles.middleCols<3>(3 * kThumb) =
          0.5 * (closing.angles + start).middleCols<3>(3 * kThumb);
    }
    return closing;
  }

 private:
  // Progress of one finger.
  struct Progress {
    int first_free = 3;  // joints before it are stopped; 3: the finger is done
    double room = 0.0;   // clearance to the nearest obstacle, meters
  };
  using ByFinger = std::array<Progress, kNumFingers>;

  // Valid until the next call.
  const Eigen::Matrix3Xd& VerticesAt(const HandAngles& angles) {
    const Eigen::Matrix3Xd& vertices = hand_.At(axes_.PoseOf(angles)).Vertices();
    BallCenters(landmarks_, vertices, centers_);
    return vertices;
  }

  // Minimum distance of a part's skin to the object, at most `most`.
  double SkinClearance(const Eigen::Matrix3Xd& vertices, int part,
                       double most = std::numeric_limits<double>::infinity()) const {
    return landmarks_.SkinPatches(part).Least(
        [&](int s) {
          const SkinPoint& point = landmarks_.Skin()[s];
          const Eigen::Vector3d x = 0.5 * (vertices.col(point.a) + vertices.col(point.b));
          return object_.Linear(object_from_wrist_ * x);
        },
        most);
  }

  // Upper bound on skin distances that can still be the finger's nearest obstacle.
  double MostOfUse(const Progress& progress) const {
    constexpr double kRounding = 1e-9;
    return std::max(progress.room, 0.0) + kClosingTouch + kRounding;
  }
  // Clearance (meters) of a finger to the palm and to the thumb (for the thumb, to the fingers);
  // negative on collision. Neighboring fingers rub along each other all the time and are ignored.
  double RoomInHand(const Eigen::Matrix3Xd& vertices, int finger) const {
    double room = std::numeric_limits<double>::infinity();
    for (const HandLandmarks::BallPair& pair : meeting_thumb_[finger]) {
      room = std::min(
          room, (centers_.col(pair.first) - centers_.col(pair.second)).norm() - pair.free_distance);
    }
    for (std::size_t i = 0; i < landmarks_.Balls().size(); ++i) {
      const FingerBall& ball = landmarks_.Balls()[i];
      if (ball.finger_joint != 3 * finger + 2) continue;
      double nearest = std::numeric_limits<double>::infinity();
      for (const int v : landmarks_.PalmSkin()) {
        nearest = std::min(nearest, (centers_.col(i) - vertices.col(v)).squaredNorm());
      }
      room = std::min(room, std::sqrt(nearest) - ball.radius);
    }
    return room;
  }

  // 0 if the thumb touches nothing, 1 if it touches, up to 2 with its pad flat on the surface.
  double ThumbWorth(const Closing& state) {
    constexpr int kTip = 3 * kThumb + 2;
    if (!state.touching[kTip]) return state.touching[kTip - 1] ? 0.5 : 0.0;
    const Eigen::Matrix3Xd& vertices = VerticesAt(state.angles);
    const Eigen::Vector3d facing =
        hand_.At(axes_.PoseOf(state.angles)).JointRotation(kTip) * axes_.PadDirection(kTip);
    double nearest = std::numeric_limits<double>::infinity();
    Eigen::Vector3d outward = Eigen::Vector3d::Zero();
    for (const int i : landmarks_.Pad(kTip)) {
      Eigen::Vector3d gradient;
      const double d = object_.Distance(object_from_wrist_ * vertices.col(i), &gradient);
      if (d < nearest) {
        nearest = d;
        outward = wrist_from_object_.linear() * gradient;
      }
    }
    return 1.0 + std::max(0.0, -facing.dot(outward));
  }

  // Joint rotation of a finger per step: no more than its tip can move, but at least kClosingStep.
  double StepOf(int finger, const Progress& progress) const {
    constexpr double kShare = 0.85, kMost = 0.6, kBeyondTip = 0.008;
    double way = 0.0;  // displacement of the tip, meters per radian
    double reach = (axes_.RestTips().col(finger) - axes_.RestJoints().col(3 * finger + 2)).norm();
    for (int j = 2; j >= progress.first_free; --j) {
      const int joint = 3 * finger + j;
      if (j < 2) {
        reach += (axes_.RestJoints().col(joint + 1) - axes_.RestJoints().col(joint)).norm();
      }
      way += Speed(joint) * (reach + kBeyondTip);
    }
    return std::clamp(kShare * progress.room / way, kClosingStep, kMost);
  }

  // Marks fingers that do not move as done and stops the joints of the others that already touch.
  ByFinger StopWhereTouching(Closing& state, const std::array<bool, kNumFingers>& moving) {
    ByFinger progress;
    const Eigen::Matrix3Xd& vertices = VerticesAt(state.angles);
    for (int finger = 0; finger < kNumFingers; ++finger) {
      if (!moving[finger]) continue;
      progress[finger] = {0, RoomInHand(vertices, finger)};
      for (int j = 0; j < 3; ++j) {
        const double d = SkinClearance(vertices, 3 * finger + j, MostOfUse(progress[finger]));
        progress[finger].room = std::min(progress[finger].room, d - kClosingTouch);
        if (d < kClosingTouch) {
          state.touching[3 * finger + j] = true;
          progress[finger].first_free = j + 1;
        }
      }
    }
    return progress;
  }

  // Turns the free joints by one step within their limits and marks fingers at their limits as
  // done. Returns false when all are done.
  bool BendFreeJoints(ByFinger& progress, HandAngles& next) const {
    bool moves = false;
    for (int finger = 0; finger < kNumFingers; ++finger) {
      if (progress[finger].first_free == 3) continue;
      const double step = StepOf(finger, progress[finger]);
      bool finger_moves = false;
      for (int j = progress[finger].first_free; j < 3; ++j) {
        const int joint = 3 * finger + j;
        const double before = next(0, joint);
        next(0, joint) =
            std::max(before, std::min(before + Speed(joint) * step, axes_.Range(0, joint).high));
        finger_moves |= next(0, joint) > before + 1e-9;
      }
      if (!finger_moves) progress[finger].first_free = 3;
      moves |= finger_moves;
    }
    return moves;
  }

  // Moves one finger to its angles in `next`, with the skin at `vertices`, unless something is in
  // the way.
  void TakeStep(int finger, const Eigen::Matrix3Xd& vertices, const HandAngles& next,
                Closing& state, Progress& progress) const {
    if (progress.first_free == 3) return;
    progress.room = RoomInHand(vertices, finger);
    if (progress.room < 0.0) {
      progress.first_free = 3;
      return;
    }
    int touched = -1;
    double deepest = std::numeric_limits<double>::infinity();
    for (int j = progress.first_free; j < 3; ++j) {
      const double d = SkinClearance(vertices, 3 * finger + j, MostOfUse(progress));
      if (d < kClosingTouch) {
        touched = j;
        state.touching[3 * finger + j] = true;
      }
      deepest = std::min(deepest, d);
    }
    progress.room = std::min(progress.room, deepest - kClosingTouch);
    if (touched >= 0) progress.first_free = touched + 1;
    // Undo a step that penetrates clearly; the refinement closes the gap.
    if (touched >= 0 && deepest < -allowed_depth_) return;
    state.angles.middleCols<3>(3 * finger) = next.middleCols<3>(3 * finger);
  }

  // Flexes the joints of the `moving` fingers from their angles in `state` until all are blocked.
  void Bend(Closing& state, const std::array<bool, kNumFingers>& moving) {
    ByFinger progress = StopWhereTouching(state, moving);
    for (int step = 0; step < 120; ++step) {
      HandAngles next = state.angles;
      if (!BendFreeJoints(progress, next)) break;
      const Eigen::Matrix3Xd& vertices = VerticesAt(next);
      for (int finger = 0; finger < kNumFingers; ++finger) {
        TakeStep(finger, vertices, next, state, progress[finger]);
      }
    }
  }

  // Straightens the thumb and turns its root; false if this collides with the object or the hand.
  bool MoveThumbRoot(double abduction, Closing& attempt) {
    attempt.angles(0, 3 * kThumb) = -15.0 * kDegree;
    attempt.angles(1, 3 * kThumb) = abduction;
    attempt.angles(0, 3 * kThumb + 1) = attempt.angles(0, 3 * kThumb + 2) = 0.0;
    const Eigen::Matrix3Xd& vertices = VerticesAt(attempt.angles);
    return !(SkinClearance(vertices, 3 * kThumb + 1) < 0.0 ||
             SkinClearance(vertices, 3 * kThumb + 2) < 0.0 || RoomInHand(vertices, kThumb) < 0.0);
  }

  // Closes the thumb over the other fingers. Uses the placement's own root abduction if that brings
  // the pad onto the object, else the abduction with the best contact.
  Closing BringThumb(const Closing& closing, const HandAngles& start) {
    std::array<bool, kNumFingers> thumb_only{};
    thumb_only[kThumb] = true;
    Closing best = closing;
    double best_worth = -1.0;
    const double own_way = start(1, 3 * kThumb);
    for (const double abduction :
         {own_way, 35.0 * kDegree, 15.0 * kDegree, 50.0 * kDegree, -5.0 * kDegree}) {
      Closing attempt = closing;
      if (abduction != own_way && !MoveThumbRoot(abduction, attempt)) continue;
      Bend(attempt, thumb_only);
      const double worth = ThumbWorth(attempt);
      if (worth > best_worth) {
        best_worth = worth;
        best = attempt;
      }
      if (best_worth > 1.5) break;
    }
    return best;
  }

  // A finger that met nothing has closed to a fist: it follows its neighbor instead.
  void RestIdleFingers(Closing& closing) const {
    constexpr int kOrder[4] = {kIndex, kMiddle, kRing, kPinky};
    const HandAngles relaxed = axes_.Relaxed();
    for (int n = 0; n < 4; ++n) {
      const int finger = kOrder[n];
      if (closing.finger_touching[finger] || !fingers_[finger]) continue;
      int model = -1;
      for (int apart = 1; apart < 4 && model < 0; ++apart) {
        for (const int m : {n - apart, n + apart}) {
          if (m >= 0 && m < 4 && closing.finger_touching[kOrder[m]]) model = kOrder[m];
        }
      }
      for (int j = 0; j < 3; ++j) {
        const int joint = 3 * finger + j;
        closing.angles(0, joint) =
            model < 0 ? relaxed(0, joint)
                      : std::min(closing.angles(0, joint), closing.angles(0, 3 * model + j));
      }
    }
  }

  const HandAxes& axes_;
  const HandLandmarks& landmarks_;
  HandEvaluation& hand_;
  const DistanceGrid& object_;
  const Eigen::Isometry3d& wrist_from_object_;
  const Eigen::Isometry3d object_from_wrist_;
  const std::array<bool, kNumFingers>& fingers_;
  const double allowed_depth_;
  // Per finger, its pairs with the thumb.
  std::array<std::vector<HandLandmarks::BallPair>, kNumFingers> meeting_thumb_;
  Eigen::Matrix3Xd centers_;  // of the balls, at the last VerticesAt
};

}  // namespace

Closing CloseFingers(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                     const Eigen::Isometry3d& wrist_from_object, const HandAngles& start,
                     const std::array<bool, kNumFingers>& fingers, double allowed_depth_m) {
  return FingerCloser(anatomy, hand, object, wrist_from_object, fingers, allowed_depth_m)
      .Close(start);
}

}  // namespace holdfast
