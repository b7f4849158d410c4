// SPDX-License-Identifier: MIT
#include "solver/hand/hand_landmarks.h"

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <utility>

#include <ceres/ceres.h>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Balls along a bone, as fractions of its length; the tip's last ball ends near the nail's edge.
constexpr std::array<double, 3> kBallsAlong = {0.2, 0.5, 0.8};
// Overlap of neighboring fingers that is not counted: skin is soft.
constexpr double kSkinGive = 0.0015;

Eigen::Vector3d Centroid(const Eigen::Matrix3Xd& vertices, const std::vector<int>& ids) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int i : ids) sum += vertices.col(i);
  return sum / static_cast<double>(ids.size());
}

}  // namespace

HandLandmarks::HandLandmarks(const HandModel& hand, const HandAxes& axes) {
  const BodySurface& surface = hand.Surface();
  const Eigen::Vector3d wrist = surface.RestJoints().col(WristJoint(hand.HandSide()));
  const Eigen::Matrix3Xd vertices = surface.RestVertices().colwise() - wrist;
  const RestHand rest{axes, vertices, VertexNormals({vertices, surface.Faces()})};
  const int first = HandBegin(hand.HandSide());
  for (int i = 0; i < hand.NumVertices(); ++i) {
    const int k = DominantJoint(surface, i) - first;
    part_of_.push_back(k >= 0 && k < kJointsPerHand ? k : kPalmPart);
  }
  FindSkin(hand);
  FindSkinPatches(rest);
  FindPads(rest);
  FindPadCenters(rest);
  FindBalls(rest);
  FindPalmAndForearm(rest);
}

void HandLandmarks::FindSkin(const HandModel& hand) {
  const BodySurface& surface = hand.Surface();
  for (int i = 0; i < hand.NumVertices(); ++i) skin_.push_back({i, i, part_of_[i]});
  std::set<std::pair<int, int>> edges;
  for (Eigen::Index f = 0; f < surface.Faces().cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      edges.insert(std::minmax({surface.Faces()(c, f), surface.Faces()((c + 1) % 3, f)}));
    }
  }
  for (const auto& [a, b] : edges) skin_.push_back({a, b, part_of_[a]});
}

void HandLandmarks::FindSkinPatches(const RestHand& rest) {
  constexpr double kStretch = 0.25;  // of skin where fingers bend
  Eigen::Matrix3Xd positions;
  SkinPositions(*this, rest.vertices, positions);
  for (int part = 0; part < kNumHandParts; ++part) {
    std::vector<int> ids;
    for (int s = 0; s < static_cast<int>(skin_.size()); ++s) {
      if (skin_[s].part == part) ids.push_back(s);
    }
    skin_patches_[part] = PointPatches(positions, std::move(ids), kStretch);
  }
}

void HandLandmarks::FindPads(const RestHand& rest) {
  const HandAxes& axes = rest.axes;
  for (int i = 0; i < rest.vertices.cols(); ++i) {
    const int part = part_of_[i];
    if (part == kPalmPart) {
      const double along = rest.vertices.col(i).dot(axes.Forward());
      if (along > 0.015 && rest.normals.col(i).dot(axes.PalmNormal()) > 0.6)
        pads_[part].push_back(i);
    } else if (rest.normals.col(i).dot(axes.PadDirection(part)) > 0.5) {
      pads_[part].push_back(i);
    }
  }
}

void HandLandmarks::FindPadCenters(const RestHand& rest) {
  const HandAxes& axes = rest.axes;
  for (int finger = 0; finger < kNumFingers; ++finger) {
    const int last = 3 * finger + 2;
    // The center of a pad is at about half of the last phalanx, on the line of its bone.
    const Eigen::Vector3d joint = axes.RestJoints().col(last);
    const Eigen::Vector3d middle =
        joint + 0.55 * (axes.RestTips().col(finger) - joint) + 0.01 * axes.PadDirection(last);
    double nearest = std::numeric_limits<double>::infinity();
    for (const int i : pads_[last]) {
      const double d = (rest.vertices.col(i) - middle).squaredNorm();
      if (d < nearest) {
        nearest = d;
        pad_centers_[finger] = i;
      }
    }
  }
}

void HandLandmarks::FindBalls(const RestHand& rest) {
  const HandAxes& axes = rest.axes;
  std::vector<Eigen::Vector3d> centers;
  for (int k = 0; k < kJointsPerHand; ++k) {
    const Eigen::Vector3d from = axes.RestJoints().col(k);
    const Eigen::Vector3d to = k % 3 == 2 ? Eigen::Vector3d(axes.RestTips().col(k / 3))
                                          : Eigen::Vector3d(axes.RestJoints().col(k + 1));
    const double length = (to - from).norm();
    const Eigen::Vector3d bone = (to - from) / length;
    for (const double fraction : kBallsAlong) {
      FingerBall ball{k, {}, 0.0};
      for (int i = 0; i < rest.vertices.cols(); ++i) {
        const double along = (rest.vertices.col(i) - from).dot(bone) / length;
        if (part_of_[i] == k && std::abs(along - fraction) < 0.22) ball.ring.push_back(i);
      }
      // The thumb's metacarpal is inside the palm: it has no ring of its own.
      if (ball.ring.size() < 5 || k == 3 * kThumb) continue;
      const Eigen::Vector3d center = Centroid(rest.vertices, ball.ring);
      for (const int i : ball.ring) {
        const Eigen::Vector3d out = rest.vertices.col(i) - center;
        ball.radius += (out - out.dot(bone) * bone).norm() / static_cast<double>(ball.ring.size());
      }
      centers.push_back(center);
      balls_.push_back(std::move(ball));
    }
  }
  for (std::size_t i = 0; i < balls_.size(); ++i) {
    for (std::size_t j = i + 1; j < balls_.size(); ++j) {
      const int a = balls_[i].finger_joint, b = balls_[j].finger_joint;
      if (a / 3 == b / 3) continue;
      const double sum = balls_[i].radius + balls_[j].radius - kSkinGive;
      const double at_rest = (centers[i] - centers[j]).norm();
      ball_pairs_.push_back(
          {static_cast<int>(i), static_cast<int>(j), std::min(sum, 0.95 * at_rest)});
    }
  }
}

void HandLandmarks::FindPalmAndForearm(const RestHand& rest) {
  const HandAxes& axes = rest.axes;
  const double reach = axes.RestJoints().col(3 * kMiddle).dot(axes.Forward());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  double forearm = 0.0;
  int forearm_count = 0;
  for (int i = 0; i < rest.vertices.cols(); ++i) {
    const double along = rest.vertices.col(i).dot(axes.Forward());
    if (part_of_[i] == kPalmPart && rest.normals.col(i).dot(axes.PalmNormal()) > 0.6 &&
        along > 0.55 * reach && along < 0.95 * reach) {
      sum += rest.vertices.col(i);
      ++count;
    }
    if (along < 0.01) {
      forearm += (rest.vertices.col(i) - along * axes.Forward()).norm();
      ++forearm_count;
    }
  }
  palm_center_ = count > 0
                     ? Eigen::Vector3d(sum / count)
                     : Eigen::Vector3d(0.75 * reach * axes.Forward() + 0.015 * axes.PalmNormal());
  if (forearm_count > 0) forearm_radius_ = forearm / forearm_count;
}

void SkinPositions(const HandLandmarks& landmarks, const Eigen::Matrix3Xd& vertices,
                   Eigen::Matrix3Xd& positions) {
  const std::vector<SkinPoint>& skin = landmarks.Skin();
  positions.resize(3, static_cast<Eigen::Index>(skin.size()));
  positions.leftCols(vertices.cols()) = vertices;
  for (auto s = static_cast<std::size_t>(vertices.cols()); s < skin.size(); ++s) {
    positions.col(s) = 0.5 * (vertices.col(skin[s].a) + vertices.col(skin[s].b));
  }
}

Eigen::VectorXd SkinDistances(const HandLandmarks& landmarks, const DistanceGrid& object,
                              const Eigen::Isometry3d& object_from_skin,
                              const Eigen::Matrix3Xd& positions, double most_m) {
  constexpr double kLinear = 0.001;  // maximum error of linear interpolation, meters
  Eigen::VectorXd distances =
      Eigen::VectorXd::Constant(positions.cols(), std::numeric_limits<double>::infinity());
  for (int part = 0; part < kNumHandParts; ++part) {
    landmarks.SkinPatches(part).ForBelow(
        most_m + kLinear, [&](int s) { return object.Linear(object_from_skin * positions.col(s)); },
        [&](int s) { distances(s) = object.Distance(object_from_skin * positions.col(s)); });
  }
  return distances;
}

void BallCenters(const HandLandmarks& landmarks, const Eigen::Matrix3Xd& vertices,
                 Eigen::Matrix3Xd& centers) {
  const std::vector<FingerBall>& balls = landmarks.Balls();
  centers.resize(3, static_cast<Eigen::Index>(balls.size()));
  for (std::size_t b = 0; b < balls.size(); ++b) {
    centers.col(b) = Centroid(vertices, balls[b].ring);
  }
}

double SelfPenetration(const HandLandmarks& landmarks, const Eigen::Matrix3Xd& vertices) {
  Eigen::Matrix3Xd centers;
  BallCenters(landmarks, vertices, centers);
  double deepest = 0.0;
  for (const HandLandmarks::BallPair& pair : landmarks.BallPairs()) {
    const double distance = (centers.col(pair.first) - centers.col(pair.second)).norm();
    deepest = std::max(deepest, pair.free_distance - distance);
  }
  for (std::size_t b = 0; b < landmarks.Balls().size(); ++b) {
    const FingerBall& ball = landmarks.Balls()[b];
    if (ball.finger_joint % 3 != 2) continue;
    for (const int i : landmarks.PalmSkin()) {
      deepest =
          std::max(deepest, ball.radius - kSkinGive - (centers.col(b) - vertices.col(i)).norm());
    }
  }
  return deepest;
}

namespace {

// The rest pose is fanned out; fingers about to close are nearly parallel (degrees).
constexpr double kFan[kNumFingers] = {-3.0, 0.0, 7.0, 3.0, 0.0};

// Parameters of a pinch: all fingers bend alike.
enum Pinch {
  kRoot,
  kMiddleJoint,
  kThumbFlexion,
  kThumbAbduction,
  kThumbSecond,
  kThumbLast,
  kNumPinch
};

HandAngles PinchAngles(const HandAxes& axes, const double* x) {
  HandAngles angles = HandAngles::Zero();
  for (int finger = 0; finger < kNumFingers; ++finger) {
    if (finger == kThumb) continue;
    // Fingers beyond the middle one close slightly more, as they are shorter.
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
    const HandState& state = hand.At(anatomy.axes.PoseOf(angles));
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

HandAngles OpenHand(const HandAxes& axes, double thumb_flexion, double thumb_abduction) {
  HandAngles angles = HandAngles::Zero();
  for (int finger = 0; finger < kNumFingers; ++finger) {
    if (finger == kThumb) continue;
    for (int j = 0; j < 3; ++j) {
      angles(0, 3 * finger + j) = -axes.RestFlexion(3 * finger + j);
    }
    angles(1, 3 * finger) = kFan[finger] * kDegree;
  }
  angles(0, 3 * kThumb) = thumb_flexion * kDegree;
  angles(1, 3 * kThumb) = thumb_abduction * kDegree;
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

}  // namespace holdfast
