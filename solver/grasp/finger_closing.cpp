// SPDX-License-Identifier: MIT
#include "solver/grasp/finger_closing.h"
#include "geometry/rotation.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace holdfast {
namespace {

// Relative speeds of a finger's joints while it closes.
constexpr double kFingerSpeed[3] = {1.0, 1.0, 0.67};
constexpr double kThumbSpeed[3] = {0.6, 0.7, 0.8};

double Speed(int joint) {
  return joint / 3 == kThumb ? kThumbSpeed[joint % 3] : kFingerSpeed[joint % 3];
}

// Which skin points each finger has, by phalanx, and its balls: what a step has to look at.
struct FingerSkin {
  std::array<std::vector<int>, 3> points;
};

}  // namespace

Closing CloseFingers(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                     const Eigen::Isometry3d& wrist_from_object, const HandAngles& start,
                     const ClosingOptions& options) {
  const HandAxes& axes = anatomy.axes;
  const HandLandmarks& landmarks = anatomy.landmarks;
  const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
  std::array<FingerSkin, kNumFingers> skin;
  for (int s = 0; s < static_cast<int>(landmarks.Skin().size()); ++s) {
    const int part = landmarks.Skin()[s].part;
    if (part != kPalmPart) skin[part / 3].points[part % 3].push_back(s);
  }

  Closing closing{start, {}, {}};
  const auto vertices_at = [&](const HandAngles& angles) -> const Eigen::Matrix3Xd& {
    const FingerPose pose = axes.PoseOf(angles);
    return hand.At(pose.data(), false).Vertices();
  };
  const auto clearance = [&](const Eigen::Matrix3Xd& vertices, const std::vector<int>& points) {
    double least = std::numeric_limits<double>::infinity();
    for (const int s : points) {
      const SkinPoint& point = landmarks.Skin()[s];
      const Eigen::Vector3d x = 0.5 * (vertices.col(point.a) + vertices.col(point.b));
      least = std::min(least, object.Distance(object_from_wrist * x));
    }
    return least;
  };
  const auto finger_blocked = [&](const Eigen::Matrix3Xd& vertices, int finger) {
    Eigen::Matrix3Xd centers;
    BallCenters(landmarks, vertices, centers);
    for (const HandLandmarks::BallPair& pair : landmarks.BallPairs()) {
      const int a = landmarks.Balls()[pair.first].finger_joint / 3;
      const int b = landmarks.Balls()[pair.second].finger_joint / 3;
      // Neighbouring fingers rub along each other all the time; only the thumb blocks.
      if (a != kThumb && b != kThumb) continue;
      if (a != finger && b != finger) continue;
      if ((centers.col(pair.first) - centers.col(pair.second)).norm() < pair.free_distance) {
        return true;
      }
    }
    for (std::size_t i = 0; i < landmarks.Balls().size(); ++i) {
      const FingerBall& ball = landmarks.Balls()[i];
      if (ball.finger_joint != 3 * finger + 2) continue;
      for (const int v : landmarks.PalmSkin()) {
        if ((centers.col(i) - vertices.col(v)).norm() < ball.radius) return true;
      }
    }
    return false;
  };

  // 0 where the thumb touches nothing, 1 where it touches, up to 2 with the pad flat on the
  // surface.
  const auto thumb_worth = [&](const Closing& state) {
    constexpr int kTip = 3 * kThumb + 2;
    if (!state.touching[kTip]) return state.touching[kTip - 1] ? 0.5 : 0.0;
    const Eigen::Matrix3Xd& vertices = vertices_at(state.angles);
    const FingerPose pose = axes.PoseOf(state.angles);
    const Eigen::Vector3d facing =
        hand.At(pose.data(), false).JointRotation(kTip) * axes.PadDirection(kTip);
    double nearest = std::numeric_limits<double>::infinity();
    Eigen::Vector3d outward = Eigen::Vector3d::Zero();
    for (const int i : landmarks.Pad(kTip)) {
      Eigen::Vector3d gradient;
      const double d = object.Distance(object_from_wrist * vertices.col(i), &gradient);
      if (d < nearest) {
        nearest = d;
        outward = wrist_from_object.linear() * gradient;
      }
    }
    return 1.0 + std::max(0.0, -facing.dot(outward));
  };

  // Bends the joints of `moving` fingers from where `state` has them until nothing more can.
  const auto close = [&](Closing& state, const std::array<bool, kNumFingers>& moving) {
    std::array<int, kNumFingers> first_free{};  // joints before it are stopped; 3: done
    const Eigen::Matrix3Xd* vertices = &vertices_at(state.angles);
    for (int finger = 0; finger < kNumFingers; ++finger) {
      first_free[finger] = moving[finger] ? 0 : 3;
      if (!moving[finger]) continue;
      for (int j = 0; j < 3; ++j) {
        if (clearance(*vertices, skin[finger].points[j]) < options.touch_distance) {
          state.touching[3 * finger + j] = true;
          first_free[finger] = j + 1;
        }
      }
    }
    for (int step = 0; step < 120; ++step) {
      HandAngles next = state.angles;
      bool moves = false;
      for (int finger = 0; finger < kNumFingers; ++finger) {
        bool finger_moves = false;
        for (int j = first_free[finger]; j < 3; ++j) {
          const int joint = 3 * finger + j;
          const double before = next(0, joint);
          next(0, joint) = std::max(
              before, std::min(before + Speed(joint) * options.step, axes.Range(0, joint).high));
          finger_moves |= next(0, joint) > before + 1e-9;
        }
        if (!finger_moves) first_free[finger] = 3;
        moves |= finger_moves;
      }
      if (!moves) break;
      vertices = &vertices_at(next);
      for (int finger = 0; finger < kNumFingers; ++finger) {
        if (first_free[finger] == 3) continue;
        if (finger_blocked(*vertices, finger)) {
          first_free[finger] = 3;
          continue;
        }
        int touched = -1;
        double deepest = std::numeric_limits<double>::infinity();
        for (int j = first_free[finger]; j < 3; ++j) {
          const double d = clearance(*vertices, skin[finger].points[j]);
          if (d < options.touch_distance) {
            touched = j;
            state.touching[3 * finger + j] = true;
          }
          deepest = std::min(deepest, d);
        }
        if (touched >= 0) first_free[finger] = touched + 1;
        // A step that went clearly in is taken back; the refinement closes the gap.
        if (touched >= 0 && deepest < -options.allowed_depth) continue;
        state.angles.middleCols<3>(3 * finger) = next.middleCols<3>(3 * finger);
      }
    }
  };

  std::array<bool, kNumFingers> moving = options.fingers;
  moving[kThumb] = false;
  close(closing, moving);

  // The thumb comes over them. Where it goes is decided at its root: the placement's own way if
  // that brings the pad onto the object, else the way that does best.
  if (options.fingers[kThumb]) {
    std::array<bool, kNumFingers> thumb_only{};
    thumb_only[kThumb] = true;
    Closing best = closing;
    double best_worth = -1.0;
    const double own_way = start(1, 3 * kThumb);
    for (const double abduction :
         {own_way, 35.0 * kDegree, 15.0 * kDegree, 50.0 * kDegree, -5.0 * kDegree}) {
      Closing attempt = closing;
      if (abduction != own_way) {
        attempt.angles(0, 3 * kThumb) = -15.0 * kDegree;
        attempt.angles(1, 3 * kThumb) = abduction;
        attempt.angles(0, 3 * kThumb + 1) = attempt.angles(0, 3 * kThumb + 2) = 0.0;
        const Eigen::Matrix3Xd& vertices = vertices_at(attempt.angles);
        if (clearance(vertices, skin[kThumb].points[1]) < 0.0 ||
            clearance(vertices, skin[kThumb].points[2]) < 0.0 || finger_blocked(vertices, kThumb)) {
          continue;
        }
      }
      close(attempt, thumb_only);
      const double worth = thumb_worth(attempt);
      if (worth > best_worth) {
        best_worth = worth;
        best = attempt;
      }
      if (best_worth > 1.5) break;
    }
    closing = best;
  }

  for (int finger = 0; finger < kNumFingers; ++finger) {
    for (int j = 0; j < 3; ++j) {
      closing.finger_touching[finger] |= closing.touching[3 * finger + j];
    }
  }
  // A finger that met nothing has made a fist: it goes with its neighbour instead.
  constexpr int kOrder[4] = {kIndex, kMiddle, kRing, kPinky};
  const HandAngles relaxed = axes.Relaxed();
  for (int n = 0; n < 4; ++n) {
    const int finger = kOrder[n];
    if (closing.finger_touching[finger] || !options.fingers[finger]) continue;
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
  if (!closing.finger_touching[kThumb] && options.fingers[kThumb]) {
    // Rests where it stopped at the latest, halfway otherwise.
    closing.angles.middleCols<3>(3 * kThumb) =
        0.5 * (closing.angles + start).middleCols<3>(3 * kThumb);
  }
  return closing;
}

}  // namespace holdfast
