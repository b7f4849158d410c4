// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kPinchStep = 0.0125;  // spacing of the widths of the prepared pinches
constexpr int kNumPinches = 9;
constexpr double kPinchRoom = 0.008;  // extra opening of a pinch beyond the object's width
constexpr double kPowerMinWidth = 0.008;
constexpr double kPowerMaxWidth = 0.095;

Eigen::Matrix3d Triad(const Eigen::Vector3d& approach, const Eigen::Vector3d& axis) {
  Eigen::Matrix3d m;
  m << approach, axis, approach.cross(axis);
  return m;
}

// Minimum distance of some skin points to the object; a distance below `enough` stops the search.
double Clearance(const DistanceGrid& object, const Eigen::Isometry3d& object_from_wrist,
                 const Eigen::Matrix3Xd& skin, const PointPatches& points, double enough) {
  return points.Least([&](int s) { return object.Linear(object_from_wrist * skin.col(s)); },
                      std::numeric_limits<double>::infinity(), enough);
}

}  // namespace

GraspPlacer::GraspPlacer(const HandAnatomy& anatomy) : anatomy_(anatomy) {
  const HandAngles open = OpenHand(anatomy.axes);
  constexpr double kThumbs[][2] = {{-15.0, 25.0}, {-20.0, 50.0}, {-20.0, 0.0}, {0.0, 45.0}};
  for (const auto& [flexion, abduction] : kThumbs) {
    HandAngles angles = open;
    angles(0, 3 * kThumb) = flexion * kDegree;
    angles(1, 3 * kThumb) = abduction * kDegree;
    open_.push_back(Posed(anatomy.axes.Clamp(angles)));
  }
  for (int i = 0; i < kNumPinches; ++i) {
    pinch_.push_back(Posed(PinchHand(anatomy, (i + 1) * kPinchStep)));
  }
}

GraspPlacer::PosedHand GraspPlacer::Posed(const HandAngles& angles) const {
  HandEvaluation hand = AtWrist(anatomy_.hand);
  const FingerPose fingers = anatomy_.axes.PoseOf(angles);
  const Eigen::Matrix3Xd& vertices = hand.At(fingers.data(), false).Vertices();
  PosedHand posed;
  posed.angles = angles;
  SkinPositions(anatomy_.landmarks, vertices, posed.skin);
  const Eigen::Vector3d thumb = vertices.col(anatomy_.landmarks.PadCenter(kThumb));
  const Eigen::Vector3d others = 0.5 * (vertices.col(anatomy_.landmarks.PadCenter(kIndex)) +
                                        vertices.col(anatomy_.landmarks.PadCenter(kMiddle)));
  posed.center = 0.5 * (thumb + others);
  posed.width = (others - thumb).norm();
  posed.axis = (others - thumb).normalized();
  const Eigen::Vector3d out = posed.center - anatomy_.landmarks.PalmCenter();
  posed.approach = (out - out.dot(posed.axis) * posed.axis).normalized();
  FindPatches(posed);
  return posed;
}

void GraspPlacer::FindPatches(PosedHand& posed) const {
  const HandLandmarks& landmarks = anatomy_.landmarks;
  std::vector<int> palm_side, fingers, thumb;
  for (int part = 0; part < kNumHandParts; ++part) {
    // For contact with objects, the base of the thumb is part of the palm.
    const bool of_thumb = part != kPalmPart && part / 3 == kThumb && part % 3 != 0;
    const std::vector<int>& skin = landmarks.SkinPatches(part).Ids();
    std::vector<int>& all = of_thumb ? thumb : fingers;
    all.insert(all.end(), skin.begin(), skin.end());
    if (of_thumb) continue;
    palm_side.insert(palm_side.end(), landmarks.Pad(part).begin(), landmarks.Pad(part).end());
  }
  posed.palm_side = PointPatches(posed.skin, std::move(palm_side));
  posed.palm = PointPatches(posed.skin, landmarks.PalmSkin());
  posed.fingers = PointPatches(posed.skin, std::move(fingers));
  posed.thumb = PointPatches(posed.skin, std::move(thumb));
}

bool GraspPlacer::ForearmClear(const DistanceGrid& object,
                               const Eigen::Isometry3d& wrist_from_object) const {
  const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
  const double radius = anatomy_.landmarks.ForearmRadius() + 0.004;
  for (double behind = 0.02; behind < 0.24; behind += 0.02) {
    const Eigen::Vector3d x = -behind * anatomy_.axes.Forward();
    if (object.Linear(object_from_wrist * x) < radius) return false;
  }
  return true;
}

std::vector<Placement> GraspPlacer::Place(const Opposition& opposition, const Target& target,
                                          int turns) const {
  std::vector<Placement> placements;
  const Eigen::Vector3d side = opposition.axis.unitOrthogonal();
  for (int turn = 0; turn < turns; ++turn) {
    const double angle = 2.0 * std::numbers::pi * turn / turns;
    const Eigen::Vector3d approach = Eigen::AngleAxisd(angle, opposition.axis) * side;
    for (const double sign : {1.0, -1.0}) {
      PlacePower(opposition, sign * opposition.axis, approach, target, placements);
      PlacePrecision(opposition, sign * opposition.axis, approach, target, placements);
    }
  }
  return placements;
}

void GraspPlacer::PlacePower(const Opposition& opposition, const Eigen::Vector3d& axis,
                             const Eigen::Vector3d& approach, const Target& target,
                             std::vector<Placement>& placements) const {
  if (opposition.width < kPowerMinWidth || opposition.width > kPowerMaxWidth) return;
  const HandAxes& axes = anatomy_.axes;
  const DistanceGrid& object = target.object;
  // The palm's normal points at the object. The direction from thumb to fingers is along the hand,
  // or oblique, as a handle lies across a palm.
  for (const double roll : {0.0, 25.0 * kDegree, -25.0 * kDegree}) {
    const Eigen::Vector3d along = Eigen::AngleAxisd(roll, axes.PalmNormal()) * axes.Forward();
    Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
    wrist_from_object.linear() =
        Triad(axes.PalmNormal(), along) * Triad(approach, axis).transpose();
    const Eigen::Vector3d turned_center = wrist_from_object.linear() * opposition.center;

    // Move towards the palm until something touches: no step exceeds the clearance.
    double height = 0.6 * target.size + 0.12;
    double clearance = 0.0;
    for (int step = 0; step < 40; ++step) {
      wrist_from_object.translation() =
          anatomy_.landmarks.PalmCenter() + height * axes.PalmNormal() - turned_center;
      clearance = Clearance(object, wrist_from_object.inverse(), open_[0].skin, open_[0].palm_side,
                            -target.allowed_depth);
      if (clearance < 0.0008 || height < -0.01) break;
      height -= std::max(clearance - 0.0004, 0.0002);
    }
    // Too deep for this thickness: another part of the object touches first.
    const double half_thick = std::max(0.0, -object.Distance(opposition.center));
    if (clearance < -target.allowed_depth || height < 0.4 * half_thick || height > 0.075) continue;
    const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
    const double allowed = -target.allowed_depth;
    if (Clearance(object, object_from_wrist, open_[0].skin, open_[0].fingers, allowed) < allowed) {
      continue;
    }
    constexpr double kOnPalm = 0.012;
    if (Clearance(object, object_from_wrist, open_[0].skin, open_[0].palm, kOnPalm) > kOnPalm ||
        !ForearmClear(object, wrist_from_object)) {
      continue;
    }
    for (const PosedHand& posed : open_) {
      if (Clearance(object, object_from_wrist, posed.skin, posed.thumb, 0.0) < 0.0) continue;
      const double snug = std::exp(-std::abs(height - 0.5 * opposition.width) / 0.02);
      placements.push_back({GraspStyle::kPower, wrist_from_object, posed.angles, opposition.width,
                            opposition.quality * (0.5 + 0.5 * snug)});
      break;
    }
  }
}

void GraspPlacer::PlacePrecision(const Opposition& opposition, const Eigen::Vector3d& axis,
                                 const Eigen::Vector3d& approach, const Target& target,
                                 std::vector<Placement>& placements) const {
  const DistanceGrid& object = target.object;
  // Just wide enough, then wider, for walls that curve around the adjacent fingers.
  for (const double room : {kPinchRoom, kPinchRoom + 0.025}) {
    const auto posed = std::find_if(pinch_.begin(), pinch_.end(), [&](const PosedHand& hand) {
      return hand.width > opposition.width + room;
    });
    if (posed == pinch_.end()) return;
    const Eigen::Isometry3d wrist_from_object =
        PoseAt(Triad(posed->approach, posed->axis) * Triad(approach, axis).transpose(),
               opposition.center, posed->center);
    const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
    const double allowed = -target.allowed_depth;
    if (Clearance(object, object_from_wrist, posed->skin, posed->fingers, allowed) < allowed ||
        Clearance(object, object_from_wrist, posed->skin, posed->thumb, allowed) < allowed ||
        !ForearmClear(object, wrist_from_object)) {
      continue;
    }
    placements.push_back({GraspStyle::kPrecision, wrist_from_object, posed->angles,
                          opposition.width, 0.8 * opposition.quality});
    return;
  }
}

namespace {

using Wrench = Eigen::Matrix<double, 6, 1>;

constexpr int kConeEdges = 8;
constexpr int kStarts = 48;
constexpr int kDescentSteps = 40;
// A pad has an area, so it resists some torsion about its normal (lever in meters).
constexpr double kPadLever = 0.006;

// Low-discrepancy directions on the 6-sphere: Kronecker points mapped by a logistic approximation
// of the normal quantile; only evenness matters.
Wrench WrenchDirection(int i) {
  constexpr double kRatio[6] = {0.9, 0.81, 0.73, 0.656, 0.59, 0.531};
  Wrench w;
  for (int c = 0; c < 6; ++c) {
    const double u = std::fmod(0.5 + (i + 1) * kRatio[c] * std::numbers::phi, 1.0);
    const double safe = std::clamp(u, 0.01, 0.99);
    w(c) = std::log(safe / (1.0 - safe));
  }
  const double norm = w.norm();
  return norm > 1e-9 ? Wrench(w / norm) : Wrench(Wrench::Unit(0));
}

}  // namespace

double WrenchQuality(std::span<const GraspContact> contacts, const Eigen::Vector3d& centroid,
                     double length, double friction) {
  if (contacts.size() < 2 || length <= 0.0) return 0.0;
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrenches(
      6, static_cast<Eigen::Index>(contacts.size()) * (kConeEdges + 2));
  Eigen::Index column = 0;
  for (const GraspContact& contact : contacts) {
    const Eigen::Vector3d n = contact.inward;
    const Eigen::Vector3d t = n.unitOrthogonal();
    const Eigen::Vector3d b = n.cross(t);
    const Eigen::Vector3d arm = (contact.point - centroid) / length;
    for (int e = 0; e < kConeEdges; ++e) {
      const double angle = 2.0 * std::numbers::pi * e / kConeEdges;
      const Eigen::Vector3d force = n + friction * (std::cos(angle) * t + std::sin(angle) * b);
      wrenches.col(column++) << force, arm.cross(force);
    }
    for (const double sign : {-1.0, 1.0}) {
      wrenches.col(column++) << n, arm.cross(n) + sign * friction * kPadLever / length * n;
    }
  }

  double least = std::numeric_limits<double>::infinity();
  for (int start = 0; start < kStarts; ++start) {
    Wrench w = start < 12 ? Wrench((start % 2 ? -1.0 : 1.0) * Wrench::Unit(start / 2))
                          : WrenchDirection(start);
    for (int step = 0; step < kDescentSteps; ++step) {
      Eigen::Index furthest;
      const double support = (w.transpose() * wrenches).maxCoeff(&furthest);
      least = std::min(least, support);
      if (least <= 0.0) return 0.0;
      w -= 0.5 / (1.0 + 0.5 * step) * wrenches.col(furthest);
      const double norm = w.norm();
      if (norm < 1e-9) break;
      w /= norm;
    }
  }
  return least;
}

}  // namespace holdfast
