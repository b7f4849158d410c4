// SPDX-License-Identifier: MIT
#include "solver/carry/standing_grasp.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/clip/clip_body.h"
#include "geometry/error.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/carry/first_grasp.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
namespace {

// Standing pose with both arms down, the holding forearm forward, rotated by `pronation` (0: thumb
// up) and away from the body by `outward`, which does not change up in the wrist frame.
JointPose StandingPose(Side side, double pronation, double outward) {
  JointPose right = JointPose::Zero();
  const auto joint = [&](const char* name) { return right.col(*FindJoint(name)); };
  joint("pelvis") = 90.0 * kDegree * Eigen::Vector3d::UnitX();
  joint("right_shoulder") = LogSO3(ExpSO3(-outward * Eigen::Vector3d::UnitY()) *
                                   ExpSO3(-12.0 * kDegree * Eigen::Vector3d::UnitX()) *
                                   ExpSO3(76.0 * kDegree * Eigen::Vector3d::UnitZ()));
  // A forearm rotates over its length: half at the elbow, half at the wrist.
  const Eigen::Vector3d half_turn = 0.5 * pronation * Eigen::Vector3d::UnitX();
  joint("right_elbow") =
      LogSO3(ExpSO3(80.0 * kDegree * Eigen::Vector3d::UnitY()) * ExpSO3(half_turn));
  joint("right_wrist") = half_turn;
  joint("left_shoulder") = -74.0 * kDegree * Eigen::Vector3d::UnitZ();
  joint("left_elbow") = -15.0 * kDegree * Eigen::Vector3d::UnitY();
  return side == Side::kRight ? right : MirrorPose(right);
}

constexpr double kHandAloneHeight_m = 1.0;  // default height of the wrist

// trans with the pelvis above the origin and the soles at z = 0; `state` has zero trans.
Eigen::Vector3d FeetOnGround(const BodySurface& body, const JointPose& pose, BodyState& state) {
  Forward(body, pose, Eigen::Vector3d::Zero(), state);
  return {-state.joints(0, 0), -state.joints(1, 0), -state.vertices.row(2).minCoeff()};
}

// Pose and trans of a lone hand, oriented like that of a standing person.
std::pair<JointPose, Eigen::Vector3d> HandAlone(const HandModel& hand, double pronation,
                                                const Grasp& grasp) {
  HandState state(hand);
  state.SetBody(StandingPose(hand.HandSide(), pronation, 0.0), Eigen::Vector3d::Zero());
  JointPose pose = JointPose::Zero();
  pose.col(0) = LogSO3(state.WristRotation());
  SetFingers(pose, hand.HandSide(), grasp.fingers);
  return {pose, kHandAloneHeight_m * Eigen::Vector3d::UnitZ() - state.WristPosition()};
}

// A person holding an object: the data shared by all grasps.
struct Person {
  Person(const std::shared_ptr<const BodyModel>& body, Side side)
      : whole(body), hand_ids(body->HandVertexIds(side)) {
    const HandAxes other_hand(HandModel(body, {}, OtherSide(side)));
    other_fingers = other_hand.PoseOf(other_hand.Relaxed());
  }

  BodySurface whole;
  const std::vector<int>& hand_ids;  // of the holding hand
  FingerPose other_fingers;
};

// Pose and trans of a standing person with the arm as far out as the object needs to clear the
// body.
std::pair<JointPose, Eigen::Vector3d> Standing(const Person& person, const HandModel& hand,
                                               double pronation, const Grasp& grasp,
                                               const DistanceGrid& grid) {
  const Side side = hand.HandSide();
  const BodySurface& whole = person.whole;
  HandState state(hand);
  JointPose pose = JointPose::Zero();
  Eigen::Vector3d trans = Eigen::Vector3d::Zero();
  for (const double outward : {0.0, 20.0, 40.0, 60.0}) {
    pose = StandingPose(side, pronation, outward * kDegree);
    SetFingers(pose, side, grasp.fingers);
    SetFingers(pose, OtherSide(side), person.other_fingers);
    BodyState posed;
    trans = FeetOnGround(whole, pose, posed);
    state.SetBody(pose, trans);
    const Eigen::Isometry3d object_from_world =
        ObjectInWorld(grasp, state.WristRotation(), state.WristPosition()).inverse();
    bool clear = true;
    for (int i = 0; i < whole.NumVertices() && clear; ++i) {
      if (std::binary_search(person.hand_ids.begin(), person.hand_ids.end(), i)) continue;
      clear = grid.Distance(object_from_world * (posed.vertices.col(i) + trans)) > 0.0;
    }
    if (clear) break;
  }
  return {pose, trans};
}

// Possible forearm rotations; for each, adds the up direction in the wrist frame.
std::vector<double> AddPronations(const HandModel& hand, GraspOptions& grasp) {
  std::vector<double> pronations;
  HandState state(hand);
  for (double degrees = -75.0; degrees <= 75.0; degrees += 7.5) {
    pronations.push_back(degrees * kDegree);
    state.SetBody(StandingPose(hand.HandSide(), pronations.back(), 0.0), Eigen::Vector3d::Zero());
    grasp.up_in_wrist.emplace_back(state.WristRotation().transpose() * Eigen::Vector3d::UnitZ());
  }
  return pronations;
}

// Pronation for the most upright object.
double UprightPronation(const std::vector<double>& pronations,
                        const std::vector<Eigen::Vector3d>& up_in_wrist, const Grasp& grasp) {
  const Eigen::Vector3d object_up = grasp.wrist_from_object.linear() * grasp.object_up;
  std::size_t best = 0;
  for (std::size_t i = 1; i < pronations.size(); ++i) {
    if (up_in_wrist[i].dot(object_up) > up_in_wrist[best].dot(object_up)) best = i;
  }
  return pronations[best];
}

// An empty clip of the mean shape.
Clip ClipOf(const BodyModel& body) {
  Clip clip;
  clip.betas = Eigen::VectorXd::Zero(10);
  clip.body_model = body.Name();
  return clip;
}

// Adds an object to a one-frame clip, held by these hands.
void PutInHands(std::uint8_t hands, const std::string& name,
                const Eigen::Isometry3d& world_from_object, Clip& clip) {
  clip.object =
      ObjectTrack{world_from_object.translation(), LogSO3(world_from_object.linear()), name, ""};
  clip.holding_hand = {hands};
}

// One frame per grasp, with a person or hand holding the object.
Clip HeldBy(const std::shared_ptr<const BodyModel>& body, const HandModel& hand,
            const DistanceGrid& grid, std::span<const Grasp> grasps, const std::string& name,
            int threads) {
  GraspOptions ups;
  const std::vector<double> pronations = AddPronations(hand, ups);
  const auto count = static_cast<int>(grasps.size());
  Clip clip = ClipOf(*body);
  clip.trans.resize(3, count);
  clip.pose.resize(count);
  std::vector<Eigen::Isometry3d> objects(count);
  std::optional<Person> person;
  if (!body->LoneHand()) person.emplace(body, hand.HandSide());
  ParallelFor(count, threads, [&](int i) {
    const double pronation = UprightPronation(pronations, ups.up_in_wrist, grasps[i]);
    const auto [pose, trans] = person ? Standing(*person, hand, pronation, grasps[i], grid)
                                      : HandAlone(hand, pronation, grasps[i]);
    clip.trans.col(i) = trans;
    clip.pose[i] = pose;
    HandState state(hand);
    state.SetBody(pose, trans);
    objects[i] = ObjectInWorld(grasps[i], state.WristRotation(), state.WristPosition());
  });
  if (body->LoneHand()) MarkHandAlone(clip);
  PutInHands(HoldingBit(hand.HandSide()), name, objects[0], clip);
  clip.object->trans.resize(3, count);
  clip.object->orient.resize(3, count);
  for (int i = 0; i < count; ++i) {
    clip.object->trans.col(i) = objects[i].translation();
    clip.object->orient.col(i) = LogSO3(objects[i].linear());
  }
  clip.holding_hand.assign(count, HoldingBit(hand.HandSide()));
  return clip;
}

}  // namespace

Clip StandWithForearmsForward(const ClipBody& person) {
  Clip clip = ClipOf(*person.model);
  if (person.betas.size() > 0) clip.betas = person.betas;
  JointPose pose = StandingPose(Side::kRight, 0.0, 0.0);
  const JointPose left = StandingPose(Side::kLeft, 0.0, 0.0);
  for (const char* joint : {"left_shoulder", "left_elbow", "left_wrist"}) {
    pose.col(*FindJoint(joint)) = left.col(*FindJoint(joint));
  }
  clip.pose = {pose};
  BodyState state;
  clip.trans = FeetOnGround(BodySurface(person.model, person.betas), pose, state);
  return clip;
}

StandingGrasp GraspStanding(const std::shared_ptr<const BodyModel>& body, Side side,
                            const LoadedObject& object, GraspOptions options,
                            const GraspProgress& progress) {
  const HandModel hand(body, {}, side);
  const SignedDistance surface(object.mesh);
  const DistanceGrid grid(surface, {.threads = options.threads});
  AddPronations(hand, options);
  options.best_only = true;
  StandingGrasp held;
  Grasp& grasp = held.grasp;
  grasp = CloseHand(hand, object.mesh, surface, grid, options, &held.report, progress);
  if (held.report.status != GraspStatus::kFound) return held;

  held.clip = HeldBy(body, hand, grid, {&grasp, 1}, object.name, 1);
  return held;
}

StandingGraspSet GraspsStanding(const std::shared_ptr<const BodyModel>& body, Side side,
                                const LoadedObject& object, const GraspSetOptions& options,
                                const GraspProgress& progress) {
  const HandModel hand(body, {}, side);
  const SignedDistance surface(object.mesh);
  const DistanceGrid grid(surface, {.threads = options.search.threads});
  StandingGraspSet held;
  held.set = FindGrasps(hand, object.mesh, grid, options, progress);
  std::vector<Grasp> shown;
  for (const CertifiedGrasp& one : held.set.grasps) {
    if (static_cast<int>(shown.size()) < kMaxShown) shown.push_back(one.grasp);
  }
  if (!shown.empty()) {
    held.clip = HeldBy(body, hand, grid, shown, object.name, options.search.threads);
  }
  return held;
}

namespace {

std::string MeasuresText(const TriangleMesh& object) {
  const Eigen::Vector3d extent = 100.0 * Extent(object);
  return fmt::format("The object measures {:.1f} x {:.1f} x {:.1f} cm", extent.x(), extent.y(),
                     extent.z());
}

const char* PlaceRemedy(bool has_place) {
  return has_place ? "Choose another place" : "Check its unit (--object-scale)";
}

}  // namespace

OptionTable OptionsOf(GraspJob& job) {
  GraspOptions& search = job.search;
  OptionTable table;
  table.Choice("hand", job.hands,
               {{"auto", GraspHands::kAuto},
                {"right", GraspHands::kRight},
                {"left", GraspHands::kLeft},
                {"both", GraspHands::kBoth}},
               "Hand that grasps: right, left, both (the object is between the hands), or auto "
               "(right; with a MANO model, the model's hand)");
  AddStyleOption(table, "style", search.style,
                 "Grasp style: power, precision, handle (fingers through the handle), or auto "
                 "(handle if the object has one, else the best)");
  AddUseOption(table, search.use);
  table.Number("object_scale", "", job.object_scale, kPositive,
               "Multiplies the object's coordinates (0.001 for millimeters)");
  table.Number("closings", "", search.closings, {1, 100'000},
               "Number of hand placements at which to close the fingers");
  table.Number("refinements", "", search.refinements, {1, 100'000},
               "Number of closed hands to refine (the best ones)");
  table.Number("friction", "", search.friction, {0.01, 2.0},
               "Friction coefficient of skin on the object");
  table.Number("upright", "", search.upright_weight, kNonNegative,
               "Weight of keeping the object upright");
  table.Number("apart", "cm", ScaledNumber{&job.many.apart_m, 0.01}, kNonNegative,
               "Grasps are distinct if their wrists are this far apart in the object frame, cm");
  table.Number("apart_angle", "deg", ScaledNumber{&job.many.apart_rad, kDegree}, {0.0, 180.0},
               "Grasps are also distinct if their wrists differ by this rotation, degrees");
  return table;
}

Side HandFor(GraspHands hands, const BodyModel& body) {
  const Side side = hands == GraspHands::kAuto   ? body.LoneHand().value_or(Side::kRight)
                    : hands == GraspHands::kLeft ? Side::kLeft
                                                 : Side::kRight;
  RequireHands(body, HoldingBit(side));
  return side;
}

void RequireFound(const GraspReport& report, const LoadedObject& object,
                  const GraspOptions& options) {
  if (report.status == GraspStatus::kFound) return;
  std::string why = fmt::format("{}: {}", object.name, Describe(report.status));
  if (!report.candidates.empty()) why += " (best try: " + report.candidates.front().refused + ")";
  throw FitFailure(
      fmt::format("{}. {}; a hand spans about 10 cm. {}, or try --closings {} --seed {}", why,
                  MeasuresText(object.mesh), PlaceRemedy(options.place != nullptr),
                  4 * options.closings, options.seed + 1));
}

void RequireFound(const GraspSet& set, const LoadedObject& object) {
  if (!set.grasps.empty()) return;
  throw FitFailure(fmt::format("{}: {} ({} hands closed). {}", object.name, Describe(set.status),
                               set.closings, MeasuresText(object.mesh)));
}

BothHandsGrasp HoldStanding(const ClipBody& person, const LoadedObject& object,
                            const std::optional<GraspPlace::Wanted>& place,
                            BothHandsOptions options, Clip& clip) {
  if (place) {
    GraspPlace::Wanted wanted = *place;
    wanted.span_m = options.max_width_m;
    options.place = std::make_shared<const GraspPlace>(object.mesh, wanted);
  }
  const HandModel right(person.model, person.betas, Side::kRight);
  const HandModel left(person.model, person.betas, Side::kLeft);
  const SignedDistance surface(object.mesh);
  const DistanceGrid grid(surface, {.threads = options.threads});
  BothHandsGrasp grasp =
      HoldInBothHands(right, left, BodySurface(person.model, person.betas), clip.pose[0],
                      clip.trans.col(0), object.mesh, grid, options);
  if (grasp.status != GraspStatus::kFound) {
    throw FitFailure(fmt::format(
        "{} in both hands: {}. {}. {}, or take a pose with both hands in front (--clip, --frame)",
        object.name, Describe(grasp.status), MeasuresText(object.mesh),
        PlaceRemedy(place.has_value())));
  }
  clip.pose[0] = grasp.pose;
  PutInHands(kHoldsRight | kHoldsLeft, object.name, grasp.world_from_object, clip);
  return grasp;
}

nlohmann::json GraspJson(const Grasp& grasp) {
  std::vector<std::string> touching;
  for (const int finger : {kThumb, kIndex, kMiddle, kRing, kPinky}) {
    if (grasp.fingers_touching[finger]) touching.emplace_back(kFingerNames[finger]);
  }
  if (grasp.palm_touching) touching.emplace_back("palm");
  return {{"style", StyleName(grasp.style)},
          {"touching", touching},
          {"fingers_through_handle", std::ranges::count(grasp.fingers_through, true)},
          {"score", grasp.score},
          {"wrench_quality", grasp.wrench_quality},
          {"upright_cosine", grasp.upright},
          {"skin_in_keep_free_ratio", grasp.in_keep_free},
          {"skin_in_object_mm", grasp.max_penetration_mm},
          {"object_in_hand_mm", grasp.object_in_hand_mm},
          {"fingers_in_each_other_mm", grasp.self_penetration_mm},
          {"limit_excess_deg", grasp.limit_excess_deg}};
}

nlohmann::json GraspContactJson(const Grasp& grasp) {
  return {{"hand_in_object_max_mm", grasp.metrics.max_penetration_mm},
          {"hand_in_object_mean_mm", grasp.metrics.mean_penetration_mm},
          {"contact_ratio", grasp.metrics.contact_ratio},
          {"contact_threshold_mm", ContactProtocol{}.contact_threshold_mm},
          {"intersection_volume_cm3", grasp.metrics.intersection_volume_cm3}};
}

nlohmann::json GraspSearchJson(const GraspReport& report) {
  return {{"places", report.oppositions},
          {"placements", report.placements},
          {"closed", report.closings},
          {"refined", report.refinements},
          {"search_ms", report.search_ms},
          {"closing_ms", report.closing_ms},
          {"refinement_ms", report.refinement_ms}};
}

}  // namespace holdfast
