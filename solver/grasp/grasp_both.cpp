// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_both.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "generator/body/pose_builder.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_candidates.h"
#include "solver/grasp/grasp_stages.h"

namespace holdfast {
namespace {

constexpr std::array<Side, 2> kSides = {Side::kRight, Side::kLeft};

// Both arms of one person in one pose.
struct Person {
  const BodySurface& body;
  std::array<const HandAnatomy*, 2> hands;
  JointPose pose;
  Eigen::Vector3d trans;
  std::array<Eigen::Isometry3d, 2> world_from_wrist;
  Eigen::Vector3d facing;  // horizontal, unit
  std::vector<int> trunk;  // vertices outside hands and forearms
};

// Placement of the object before the hands close.
struct BothHandsPlacement {
  Eigen::Isometry3d world_from_object;
  std::array<Eigen::Isometry3d, 2> world_from_wrist;
  double width = 0.0;
  double cost = 0.0;
};

double Deepest(const Person& person, const JointPose& pose, const DistanceGrid& object,
               const Eigen::Isometry3d& world_from_object) {
  BodyState state;
  Forward(person.body, pose, person.trans, state);
  const Eigen::Isometry3d object_from_world = world_from_object.inverse();
  double deepest = 0.0;
  for (const int i : person.trunk) {
    deepest = std::max(deepest, -object.Distance(object_from_world * state.vertices.col(i)));
  }
  return deepest;
}

// Moves an arm so that its wrist is at the target; false if elbow or wrist limits prevent it.
bool Reach(const Person& person, Side side, const Eigen::Isometry3d& target,
           const WristLimits& limits, JointPose& pose) {
  constexpr double kReached = 0.001;  // meters
  const Eigen::Matrix3Xd& rest = person.body.RestJoints();
  if (MoveWrist(rest, side, target.linear(), target.translation(), person.trans, pose) > kReached) {
    return false;
  }
  BodyState state;
  ForwardJoints(rest, pose, person.trans, state);
  const Limb arm = Arm(side);
  const WristPose wrist =
      SolveWrist(rest, side, state.world_rotation[arm.middle], target.linear(), limits);
  if (!wrist.reached) return false;
  const Eigen::Vector3d upper = state.joints.col(arm.middle) - state.joints.col(arm.root);
  const Eigen::Vector3d lower = state.joints.col(arm.end) - state.joints.col(arm.middle);
  const double flexion = std::atan2(upper.cross(lower).norm(), upper.dot(lower));
  if (flexion > arm.max_flexion_rad) return false;
  // Elbow and wrist share the forearm's twist.
  pose.col(arm.middle) = LogSO3(state.world_rotation[arm.root].transpose() * wrist.lower);
  pose.col(arm.end) = LogSO3(wrist.wrist);
  return true;
}

// Rotation that maps `axis` to `to` and keeps z as close to world z as that allows.
Eigen::Matrix3d KeepUp(const Eigen::Vector3d& axis, const Eigen::Vector3d& to) {
  const auto frame = [](const Eigen::Vector3d& first, const Eigen::Vector3d& up) {
    Eigen::Vector3d second = up - up.dot(first) * first;
    second = second.norm() > 0.1 ? Eigen::Vector3d(second.normalized()) : first.unitOrthogonal();
    Eigen::Matrix3d m;
    m << first, second, first.cross(second);
    return m;
  };
  return frame(to, Eigen::Vector3d::UnitZ()) * frame(axis, Eigen::Vector3d::UnitZ()).transpose();
}

// Places a span of the object between the hands and computes the cost of holding it there.
std::optional<BothHandsPlacement> PlaceBetween(const Person& person, const Opposition& span,
                                               double sign, const TriangleMesh& mesh,
                                               const DistanceGrid& object,
                                               const Eigen::Vector3d& centroid,
                                               const BothHandsOptions& options) {
  std::array<Eigen::Vector3d, 2> palm, normal;
  for (int h = 0; h < 2; ++h) {
    palm[h] = person.world_from_wrist[h] * person.hands[h]->landmarks.PalmCenter();
    normal[h] = person.world_from_wrist[h].linear() * person.hands[h]->axes.PalmNormal();
  }
  const Eigen::Vector3d apart = palm[1] - palm[0];
  Eigen::Vector3d level(apart.x(), apart.y(), 0.0);
  if (level.norm() < 0.02) {
    // Hands above each other or together: the object is held across the body.
    level = Eigen::Vector3d::UnitZ().cross(person.facing);
  }
  level.normalize();
  BothHandsPlacement placement;
  placement.width = span.width;
  placement.world_from_object.linear() = KeepUp(sign * span.axis, level);
  const Eigen::Vector3d middle = 0.5 * (palm[0] + palm[1]);
  const double upright = placement.world_from_object.linear()(2, 2);

  // Move the object away from the body until it is clear of it.
  bool clear = false;
  double pushed = 0.0;
  for (; pushed < 0.31 && !clear; pushed += 0.03) {
    placement.world_from_object.translation() =
        middle + pushed * person.facing - placement.world_from_object.linear() * span.center;
    clear = Deepest(person, person.pose, object, placement.world_from_object) <= 0.0;
  }
  if (!clear) return std::nullopt;
  placement.cost = options.upright_weight * (1.0 - upright) +
                   4.0 * (span.center - centroid).norm() / std::max(0.05, Extent(mesh).norm());

  for (int h = 0; h < 2; ++h) {
    const Eigen::Vector3d inward = h == 0 ? level : Eigen::Vector3d(-level);
    const Eigen::Vector3d place =
        placement.world_from_object * span.center - 0.5 * span.width * inward;
    double least = std::numeric_limits<double>::infinity();
    for (const double spin : {0.0, 25.0, -25.0, 50.0, -50.0}) {
      const Eigen::Matrix3d rotation = Eigen::AngleAxisd(spin * kDegree, inward) *
                                       RotationBetween(normal[h], inward).toRotationMatrix() *
                                       person.world_from_wrist[h].linear();
      const Eigen::Isometry3d wrist =
          PoseAt(rotation, person.hands[h]->landmarks.PalmCenter(), place);
      JointPose pose = person.pose;
      if (!Reach(person, kSides[h], wrist, options.wrist, pose)) continue;
      const double turn = LogSO3(person.world_from_wrist[h].linear().transpose() * rotation).norm();
      const double shift = (wrist.translation() - person.world_from_wrist[h].translation()).norm();
      // Avoid strongly bent wrists; 0.1 m of shift weighs like 30 degrees of turn.
      const double bend = LogSO3(ExpSO3(pose.col(WristJoint(kSides[h])))).norm();
      const double cost = turn + 5.0 * shift + 0.5 * bend;
      if (cost < least) {
        least = cost;
        placement.world_from_wrist[h] = wrist;
      }
    }
    if (!std::isfinite(least)) return std::nullopt;
    placement.cost += least;
  }
  return placement;
}

// Moves an open hand to its side of the object along the palm normal.
Eigen::Isometry3d BringUp(const HandAnatomy& anatomy, const Eigen::Matrix3Xd& open,
                          const DistanceGrid& object, Eigen::Isometry3d wrist_from_object) {
  constexpr double kFarOff = 0.10, kOn = 0.0005;
  const Eigen::Vector3d& away = anatomy.axes.PalmNormal();
  wrist_from_object.translation() += kFarOff * away;
  for (int step = 0; step < 60; ++step) {
    const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
    double clearance = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i < open.cols(); ++i) {
      clearance = std::min(clearance, object.Distance(object_from_wrist * open.col(i)));
    }
    if (clearance < kOn) break;
    wrist_from_object.translation() -= std::max(clearance - 0.5 * kOn, 0.0002) * away;
  }
  return wrist_from_object;
}

// Open hand, thumb beside a flat face or over its edge: the first free pose, else the freest.
HandAngles ThumbAside(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                      const Eigen::Isometry3d& wrist_from_object) {
  constexpr double kThumbs[][2] = {
      {-20.0, 50.0}, {-20.0, 25.0}, {-20.0, 5.0}, {-20.0, -10.0}, {0.0, -10.0}};
  constexpr double kGive = 0.001;
  const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
  HandAngles best = OpenHand(anatomy.axes);
  double most = -std::numeric_limits<double>::infinity();
  for (const auto& [flexion, abduction] : kThumbs) {
    const HandAngles angles = OpenHand(anatomy.axes, flexion, abduction);
    const Eigen::Matrix3Xd& vertices = hand.At(anatomy.axes.PoseOf(angles)).Vertices();
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < anatomy.hand.NumVertices(); ++i) {
      const int part = anatomy.landmarks.PartOf(i);
      if (part == kPalmPart || part / 3 != kThumb) continue;
      least = std::min(least, object.Distance(object_from_wrist * vertices.col(i)));
    }
    if (least > most) {
      most = least;
      best = angles;
    }
    if (least > -kGive) break;
  }
  return best;
}

// Moves a hand to its side of the object and closes it. If fingers closing over an edge leave the
// requested region of the object, the thumb stays open, or all fingers do.
Grasp CloseAtSide(const GraspScene& scene, const Eigen::Matrix3Xd& open,
                  const Eigen::Isometry3d& wrist_from_object) {
  const HandAnatomy& anatomy = scene.anatomy;
  HandEvaluation evaluation = AtWrist(anatomy.hand);
  GraspAttempt start;
  start.wrist_from_object = BringUp(anatomy, open, scene.object, wrist_from_object);
  start.angles = ThumbAside(anatomy, evaluation, scene.object, start.wrist_from_object);
  std::array<bool, kNumFingers> without_thumb = kAllFingers;
  without_thumb[kThumb] = false;
  std::optional<Grasp> best;
  for (const auto& fingers : {kAllFingers, without_thumb, std::array<bool, kNumFingers>{}}) {
    GraspAttempt attempt = start;
    attempt.angles = CloseFingers(anatomy, evaluation, scene.object, start.wrist_from_object,
                                  start.angles, fingers)
                         .angles;
    RefineGrasp(anatomy, evaluation, scene.object, {}, attempt.angles, attempt.wrist_from_object);
    const Grasp grasp = Assess(scene, evaluation, attempt, true);
    if (!best || grasp.outside_place < best->outside_place) best = grasp;
    if (best->outside_place <= GraspPlace::kMaxOutside) break;
  }
  return *best;
}

// Skin without the thumb, which would keep a palm off a flat face.
Eigen::Matrix3Xd OpenSkin(const HandAnatomy& anatomy) {
  HandEvaluation evaluation = AtWrist(anatomy.hand);
  const Eigen::Matrix3Xd& vertices =
      evaluation.At(anatomy.axes.PoseOf(OpenHand(anatomy.axes))).Vertices();
  std::vector<int> kept;
  for (int i = 0; i < static_cast<int>(vertices.cols()); ++i) {
    const int part = anatomy.landmarks.PartOf(i);
    if (part == kPalmPart || part <= 3 * kThumb) kept.push_back(i);
  }
  return vertices(Eigen::all, kept);
}

// Both hands of one search with their scenes.
struct Hands {
  Hands(const Person& person, const TriangleMesh& object, const DistanceGrid& distance,
        const GraspOptions& options)
      : placers{GraspPlacer(*person.hands[0]), GraspPlacer(*person.hands[1])},
        scenes{GraspScene(*person.hands[0], placers[0], distance, object, options),
               GraspScene(*person.hands[1], placers[1], distance, object, options)},
        open_skin{OpenSkin(*person.hands[0]), OpenSkin(*person.hands[1])} {}

  std::array<GraspPlacer, 2> placers;
  std::array<GraspScene, 2> scenes;
  std::array<Eigen::Matrix3Xd, 2> open_skin;
};

struct Closed {
  BothHandsGrasp grasp;
  double cost = std::numeric_limits<double>::infinity();
};

Closed CloseOn(const BothHandsPlacement& placement, const Person& person, const Hands& hands,
               const BothHandsOptions& options) {
  Closed closed;
  BothHandsGrasp& grasp = closed.grasp;
  grasp.pose = person.pose;
  grasp.world_from_object = placement.world_from_object;
  grasp.width_m = placement.width;
  grasp.upright = placement.world_from_object.linear()(2, 2);
  grasp.status = GraspStatus::kFound;
  double cost = placement.cost;
  bool reached = true;
  for (int h = 0; h < 2; ++h) {
    const Grasp hand =
        CloseAtSide(hands.scenes[h], hands.open_skin[h],
                    placement.world_from_wrist[h].inverse() * placement.world_from_object);
    grasp.hands[h] = hand;
    const auto fingers =
        std::count(hand.fingers_touching.begin(), hand.fingers_touching.end(), true);
    const bool clean = hand.max_penetration_mm < 1000.0 * options.max_penetration_m &&
                       hand.object_in_hand_mm < 1000.0 * options.max_penetration_m &&
                       hand.self_penetration_mm < 4.0 && hand.limit_excess_deg < 1.0;
    const bool there = hand.outside_place <= GraspPlace::kMaxOutside;
    if (!clean || !there || fingers < 2) grasp.status = GraspStatus::kNoCleanGrasp;
    cost -= 0.15 * static_cast<double>(fingers) + (hand.palm_touching ? 0.3 : 0.0);
    const Eigen::Isometry3d wrist = placement.world_from_object * hand.wrist_from_object.inverse();
    reached &= Reach(person, kSides[h], wrist, options.wrist, grasp.pose);
    SetFingers(grasp.pose, kSides[h], hand.fingers);
    const Eigen::Isometry3d& before = person.world_from_wrist[h];
    grasp.wrist_shift_mm[h] = 1000.0 * (wrist.translation() - before.translation()).norm();
    grasp.wrist_turn_deg[h] = LogSO3(before.linear().transpose() * wrist.linear()).norm() / kDegree;
  }
  if (!reached) return closed;
  const DistanceGrid& object = hands.scenes[0].object;
  grasp.in_body_mm = 1000.0 * Deepest(person, grasp.pose, object, placement.world_from_object);
  if (grasp.in_body_mm > 1000.0 * options.max_penetration_m) {
    grasp.status = GraspStatus::kNoCleanGrasp;
  }
  closed.cost = cost + (grasp.status == GraspStatus::kFound ? 0.0 : 100.0);
  return closed;
}

Person PersonIn(const BodySurface& body, const JointPose& pose, const Eigen::Vector3d& trans,
                const HandAnatomy& right, const HandAnatomy& left) {
  Person person{body, {&right, &left}, pose, trans, {}, {}, AwayFromHands(body, kSides)};
  BodyState state;
  ForwardJoints(body.RestJoints(), pose, trans, state);
  for (int h = 0; h < 2; ++h) {
    person.world_from_wrist[h] = state.WorldFromJoint(WristJoint(kSides[h]));
  }
  // Forward is orthogonal to the line between the shoulders.
  const Eigen::Vector3d shoulders =
      state.joints.col(Arm(Side::kLeft).root) - state.joints.col(Arm(Side::kRight).root);
  person.facing = shoulders.cross(Eigen::Vector3d::UnitZ());
  person.facing.z() = 0.0;
  person.facing = person.facing.norm() > 1e-6 ? Eigen::Vector3d(person.facing.normalized())
                                              : Eigen::Vector3d::UnitX();
  return person;
}

// Antipodal places that palms can lie on, within the requested place.
std::vector<Opposition> Spans(const TriangleMesh& object, const DistanceGrid& distance,
                              const Eigen::Vector3d& middle, const BothHandsOptions& options) {
  OppositionOptions search;
  search.samples = 800;
  search.count = options.spans;
  search.min_normal_cosine = 0.96;  // palms lie flat
  search.max_width_m = options.max_width_m;
  search.seed = options.seed;
  const GraspPlace* place = options.place.get();
  if (place == nullptr) return FindOppositions(object, distance, middle, search);
  search.allowed = [place](const Eigen::Vector3d& x) { return place->Allows(x); };
  std::vector<Opposition> spans = FindOppositions(place->Surface(), distance, middle, search);
  std::erase_if(spans, [&](const Opposition& span) {
    return place->At() && (span.center - middle).norm() > GraspPlace::kReach_m;
  });
  return spans;
}

}  // namespace

BothHandsGrasp HoldInBothHands(const HandModel& right, const HandModel& left,
                               const BodySurface& body, const JointPose& pose,
                               const Eigen::Vector3d& trans, const TriangleMesh& object,
                               const DistanceGrid& distance, const BothHandsOptions& options) {
  BothHandsGrasp none;
  none.pose = pose;
  const HandAnatomy right_hand(right), left_hand(left);
  const Person person = PersonIn(body, pose, trans, right_hand, left_hand);
  const Eigen::Vector3d middle = options.place ? options.place->Center() : SolidCentroid(object);
  const std::vector<Opposition> spans = Spans(object, distance, middle, options);
  if (options.place) none.status = GraspStatus::kNothingAtPlace;
  if (spans.empty()) return none;
  std::vector<std::optional<BothHandsPlacement>> tried(2 * spans.size());
  ParallelFor(static_cast<int>(tried.size()), options.threads, [&](int i) {
    tried[i] = PlaceBetween(person, spans[i / 2], i % 2 == 0 ? 1.0 : -1.0, object, distance, middle,
                            options);
  });
  std::vector<BothHandsPlacement> placements;
  for (const std::optional<BothHandsPlacement>& placement : tried) {
    if (placement) placements.push_back(*placement);
  }
  none.status = GraspStatus::kNoRoom;
  if (placements.empty()) return none;
  std::ranges::stable_sort(placements, {}, &BothHandsPlacement::cost);
  if (static_cast<int>(placements.size()) > options.closings) placements.resize(options.closings);

  GraspOptions one_hand;
  one_hand.touch_distance_m = options.touch_distance_m;
  one_hand.max_penetration_m = options.max_penetration_m;
  one_hand.seed = options.seed;
  one_hand.place = options.place;
  const Hands hands(person, object, distance, one_hand);
  std::vector<Closed> closed(placements.size());
  ParallelFor(static_cast<int>(placements.size()), options.threads,
              [&](int i) { closed[i] = CloseOn(placements[i], person, hands, options); });
  const auto best = std::ranges::min_element(closed, {}, &Closed::cost);
  return std::isfinite(best->cost) ? best->grasp : none;
}

}  // namespace holdfast
