// SPDX-License-Identifier: MIT
#include "solver/finger_closing.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <vector>

namespace holdfast {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// The rest pose is fanned out; fingers that are about to close are nearly parallel (degrees).
constexpr double kFan[kNumFingers] = {-3.0, 0.0, 7.0, 3.0, 0.0};

// Relative speeds of a finger's joints while it closes.
constexpr double kFingerSpeed[3] = {1.0, 1.0, 0.67};
constexpr double kThumbSpeed[3] = {0.6, 0.7, 0.8};

double Speed(int joint) { return joint / 3 == kThumb ? kThumbSpeed[joint % 3] : kFingerSpeed[joint % 3]; }

// Which skin points each finger has, by phalanx, and its balls: what a step has to look at.
struct FingerSkin {
  std::array<std::vector<int>, 3> points;
};

// The numbers a pinch is made of: all fingers bend alike.
enum Pinch { kRoot, kMiddleJoint, kThumbFlexion, kThumbAbduction, kThumbSecond, kThumbLast, kNumPinch };

HandAngles PinchAngles(const HandAxes& axes, const double* x) {
  HandAngles angles = HandAngles::Zero();
  for (int finger = 0; finger < kNumFingers; ++finger) {
    if (finger == kThumb) continue;
    // Fingers behind the middle one close a little further, as they are shorter.
    const double more = finger == kRing ? 4.0 * kDegree : finger == kPinky ? 8.0 * kDegree : 0.0;
    angles(0, 3 * finger) = x[kRoot] + more - axes.RestFlexion(3 * finger);
    angles(0, 3 * finger + 1) = x[kMiddleJoint] + more - axes.RestFlexion(3 * finger + 1);
    angles(0, 3 * finger + 2) =
        2.0 / 3.0 * (x[kMiddleJoint] + more) - axes.RestFlexion(3 * finger + 2);
    angles(1, 3 * finger) = kFan[finger] * kDegree;
  }
  angles(0, 3 * kThumb) = x[kThumbFlexion];
  angles(1, 3 * kThumb) = x[kThumbAbduction];
  angles(0, 3 * kThumb + 1) = x[kThumbSecond];
  angles(0, 3 * kThumb + 2) = x[kThumbLast];
  return angles;
}

struct PinchResidual {
  const HandAnatomy& anatomy;
  HandEvaluation& hand;
  double width;
  std::array<double, kNumPinch> preferred;

  static constexpr int kNumResiduals = 7 + 2 * kNumPinch;

  bool operator()(const double* x, double* residuals) const {
    const HandAngles angles = PinchAngles(anatomy.axes, x);
    const FingerPose pose = anatomy.axes.PoseOf(angles);
    const HandState& state = hand.At(pose.data(), false);
    const auto pad = [&](int finger) -> Eigen::Vector3d {
      return state.Vertices().col(anatomy.landmarks.PadCenter(finger));
    };
    const auto facing = [&](int finger) -> Eigen::Vector3d {
      return state.JointRotation(3 * finger + 2) * anatomy.axes.PadDirection(3 * finger + 2);
    };
    const Eigen::Vector3d apart = 0.5 * (pad(kIndex) + pad(kMiddle)) - pad(kThumb);
    const double distance = std::max(apart.norm(), 1e-6);
    const Eigen::Vector3d direction = apart / distance;
    residuals[0] = 100.0 * (distance - width);
    Eigen::Map<Eigen::Vector3d>(residuals + 1) = 0.5 * (facing(kThumb) - direction);
    Eigen::Map<Eigen::Vector3d>(residuals + 4) =
        0.5 * (0.5 * (facing(kIndex) + facing(kMiddle)) + direction);
    for (int i = 0; i < kNumPinch; ++i) residuals[7 + i] = 0.15 * (x[i] - preferred[i]);
    const HandAngles excess = angles - anatomy.axes.Clamp(angles);
    residuals[7 + kNumPinch + 0] = 5.0 * excess(0, 3 * kMiddle);
    residuals[7 + kNumPinch + 1] = 5.0 * excess(0, 3 * kMiddle + 1);
    residuals[7 + kNumPinch + 2] = 5.0 * excess(0, 3 * kThumb);
    residuals[7 + kNumPinch + 3] = 5.0 * excess(1, 3 * kThumb);
    residuals[7 + kNumPinch + 4] = 5.0 * excess(0, 3 * kThumb + 1);
    residuals[7 + kNumPinch + 5] = 5.0 * excess(0, 3 * kThumb + 2);
    return true;
  }
};

}  // namespace

HandEvaluation AtWrist(const HandModel& hand) {
  return HandEvaluation(hand, JointPose::Zero(),
                        -hand.Surface().RestJoints().col(WristJoint(hand.HandSide())));
}

HandAngles OpenHand(const HandAxes& axes) {
  HandAngles angles = HandAngles::Zero();
  for (int finger = 0; finger < kNumFingers; ++finger) {
    if (finger == kThumb) continue;
    for (int j = 0; j < 3; ++j) {
      angles(0, 3 * finger + j) = -axes.RestFlexion(3 * finger + j);
    }
    angles(1, 3 * finger) = kFan[finger] * kDegree;
  }
  angles(0, 3 * kThumb) = -15.0 * kDegree;
  angles(1, 3 * kThumb) = 25.0 * kDegree;
  return axes.Clamp(angles);
}

HandAngles PinchHand(const HandAnatomy& anatomy, double width) {
  HandEvaluation hand = AtWrist(anatomy.hand);
  const std::array<double, kNumPinch> preferred = {45.0 * kDegree, 35.0 * kDegree, 15.0 * kDegree,
                                                   20.0 * kDegree, 10.0 * kDegree, 15.0 * kDegree};
  std::array<double, kNumPinch> x = preferred;
  ceres::Problem problem;
  problem.AddResidualBlock(
      new ceres::NumericDiffCostFunction<PinchResidual, ceres::CENTRAL,
                                         PinchResidual::kNumResiduals, kNumPinch>(
          new PinchResidual{anatomy, hand, width, preferred}),
      nullptr, x.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 40;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return anatomy.axes.Clamp(PinchAngles(anatomy.axes, x.data()));
}

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

  // 0 where the thumb touches nothing, 1 where it touches, up to 2 with the pad flat on the surface.
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

  // The thumb comes over them. Where it goes is decided at its root: the placement's own way if that
  // brings the pad onto the object, else the way that does best.
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
            clearance(vertices, skin[kThumb].points[2]) < 0.0 ||
            finger_blocked(vertices, kThumb)) {
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
