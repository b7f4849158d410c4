// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Per face of the object, whether it lies on this part of the surface.
std::vector<bool> FacesOn(const TriangleMesh& object, const TriangleMesh& part) {
  const double near = 1e-6 * Extent(object).norm();
  const TriangleTree tree(part);
  std::vector<bool> on(static_cast<std::size_t>(object.NumFaces()));
  for (Eigen::Index f = 0; f < object.NumFaces(); ++f) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) middle += object.vertices.col(object.faces(k, f)) / 3.0;
    on[static_cast<std::size_t>(f)] = tree.Closest(middle).squared_distance <= near * near;
  }
  return on;
}

}  // namespace

GraspPlace::GraspPlace(const TriangleMesh& object, const Wanted& wanted)
    : tree_(object),
      allowed_(static_cast<std::size_t>(object.NumFaces()), true),
      at_(wanted.at),
      balls_(wanted.avoid_balls),
      required_(wanted.at || wanted.region.NumFaces() > 0 || wanted.avoid.NumFaces() > 0) {
  if (wanted.region.NumFaces() > 0) allowed_ = FacesOn(object, wanted.region);
  if (wanted.avoid.NumFaces() > 0) {
    const std::vector<bool> avoided = FacesOn(object, wanted.avoid);
    for (std::size_t f = 0; f < allowed_.size(); ++f) allowed_[f] = allowed_[f] && !avoided[f];
  }
  for (const Ball& ball : balls_) {
    const double off = std::sqrt(tree_.Closest(ball.center).squared_distance);
    if (!(off <= ball.radius)) {
      throw Error(
          "--avoid",
          fmt::format("({:g}, {:g}, {:g}) is {:.1f} cm from the object's surface, farther "
                      "than the radius of {:g} m",
                      ball.center.x(), ball.center.y(), ball.center.z(), 100.0 * off, ball.radius),
          "Give X,Y,Z,RADIUS in meters, in the object's frame");
    }
    for (Eigen::Index f = 0; f < object.NumFaces(); ++f) {
      bool within = true;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d corner = object.vertices.col(object.faces(k, f));
        within = within && (corner - ball.center).norm() <= ball.radius;
      }
      if (within) allowed_[static_cast<std::size_t>(f)] = false;
    }
  }
  std::vector<Eigen::Index> faces;
  for (Eigen::Index f = 0; f < object.NumFaces(); ++f) {
    if (allowed_[static_cast<std::size_t>(f)]) faces.push_back(f);
  }
  if (faces.empty()) {
    throw Error(wanted.avoid.NumFaces() > 0 || !balls_.empty() ? "--avoid" : "--region",
                "leaves no surface of the object to hold",
                "Choose a larger region, or avoid less of the object");
  }
  surface_ = {object.vertices, object.faces(Eigen::all, faces)};
  if (at_) {
    if (!at_->allFinite()) throw Error("--at", "is not finite", "Give three numbers, meters");
    const double off = std::sqrt(tree_.Closest(*at_).squared_distance);
    if (off > kFarthestOff_m) {
      const Eigen::Vector3d &low = tree_.Min(), &high = tree_.Max();
      throw Error(
          "--at",
          fmt::format("({:g}, {:g}, {:g}) is {:.1f} cm from the object's surface", at_->x(),
                      at_->y(), at_->z(), 100.0 * off),
          fmt::format("Give a point on the surface, in meters, in the object's frame: the object "
                      "extends from ({:.3g}, {:.3g}, {:.3g}) to ({:.3g}, {:.3g}, {:.3g})",
                      low.x(), low.y(), low.z(), high.x(), high.y(), high.z()));
    }
    center_ = *at_;
    // Hands close on both sides of the material: its center is the reference.
    const auto through = MeasureThickness(object, tree_, *at_, wanted.span_m);
    if (through) center_ = through->start + 0.5 * through->length * through->inward;
    reach_ = kReach_m + (center_ - *at_).norm();
  } else {
    constexpr int kSamples = 2000;
    center_ = SampleSurface(surface_, kSamples, 0).rowwise().mean();
  }
}

bool GraspPlace::InRegion(const Eigen::Vector3d& point) const {
  for (const Ball& ball : balls_) {
    if ((point - ball.center).norm() <= ball.radius) return false;
  }
  return allowed_[static_cast<std::size_t>(tree_.Closest(point).face)];
}

bool GraspPlace::Allows(const Eigen::Vector3d& point) const {
  return (!at_ || (point - center_).norm() <= reach_) && InRegion(point);
}

std::vector<int> AwayFromHands(const BodySurface& body, std::span<const Side> sides) {
  std::vector<int> vertices;
  for (int i = 0; i < body.NumVertices(); ++i) {
    double near = 0.0;
    for (const auto& [joint, weight] : body.Weights(i)) {
      for (const Side side : sides) {
        const bool finger = joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand;
        const bool elbow = joint == WristJoint(side) - 2;
        if (finger || joint == WristJoint(side) || elbow) near += weight;
      }
    }
    if (near < 0.2) vertices.push_back(i);
  }
  return vertices;
}

std::vector<Eigen::Matrix3Xd> BodyAroundWrist(const Clip& clip, const BodySurface& body, Side side,
                                              double reach_m, int num_frames, bool other_hand) {
  const Side sides[] = {side, side == Side::kRight ? Side::kLeft : Side::kRight};
  const std::vector<int> vertices = AwayFromHands(body, std::span(sides, other_hand ? 1 : 2));
  const int wrist = WristJoint(side);
  const int count = std::min(num_frames, clip.NumFrames());
  std::vector<Eigen::Matrix3Xd> frames;
  BodyState state;
  for (int k = 0; k < count; ++k) {
    const int t = count == 1 ? 0 : k * (clip.NumFrames() - 1) / (count - 1);
    Forward(body, clip.pose[t], clip.trans.col(t), state);
    Eigen::Matrix3Xd points(3, vertices.size());
    Eigen::Index kept = 0;
    for (const int i : vertices) {
      const Eigen::Vector3d from_wrist = state.vertices.col(i) - state.joints.col(wrist);
      if (from_wrist.squaredNorm() > reach_m * reach_m) continue;
      points.col(kept++) = state.world_rotation[wrist].transpose() * from_wrist;
    }
    points.conservativeResize(3, kept);
    frames.push_back(std::move(points));
  }
  return frames;
}

WristObstacles::WristObstacles(std::span<const Eigen::Matrix3Xd> in_wrist) : sets_(in_wrist) {
  for (const Eigen::Matrix3Xd& points : sets_) patches_.emplace_back(points);
}

double WristObstacles::ShareBlocked(const DistanceGrid& object,
                                    const Eigen::Isometry3d& wrist_from_object) const {
  constexpr double kSoftTissue = 0.002;  // meters
  if (sets_.empty()) return 0.0;
  const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
  int blocked = 0;
  for (std::size_t k = 0; k < sets_.size(); ++k) {
    const auto distance = [&](int i) { return object.Linear(object_from_wrist * sets_[k].col(i)); };
    blocked += patches_[k].Least(distance, -kSoftTissue, -kSoftTissue) < -kSoftTissue;
  }
  return blocked / static_cast<double>(sets_.size());
}

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
  constexpr double kThumbs[][2] = {{-15.0, 25.0}, {-20.0, 50.0}, {-20.0, 0.0}, {0.0, 45.0}};
  for (const auto& [flexion, abduction] : kThumbs) {
    open_.push_back(Posed(OpenHand(anatomy.axes, flexion, abduction)));
  }
  for (int i = 0; i < kNumPinches; ++i) {
    pinch_.push_back(Posed(PinchHand(anatomy, (i + 1) * kPinchStep)));
  }
}

GraspPlacer::PosedHand GraspPlacer::Posed(const HandAngles& angles) const {
  HandEvaluation hand = AtWrist(anatomy_.hand);
  const Eigen::Matrix3Xd& vertices = hand.At(anatomy_.axes.PoseOf(angles)).Vertices();
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
    const auto posed = std::ranges::find_if(
        pinch_, [&](const PosedHand& hand) { return hand.width > opposition.width + room; });
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
