// SPDX-License-Identifier: MIT
#include "solver/carry/first_grasp.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "generator/body/limb_ik.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/rotation.h"
#include "geometry/score/hand_object_score.h"
#include "solver/grasp/grasp_candidates.h"
#include "solver/grasp/grasp_placement.h"

namespace holdfast {
namespace {

// Adds the object track: the given pose in the first frame, the rest to be filled in by the fit.
void PlaceObject(const Eigen::Isometry3d& world_from_object, Clip& clip) {
  clip.object.emplace();
  clip.object->trans.setZero(3, clip.NumFrames());
  clip.object->orient.setZero(3, clip.NumFrames());
  clip.object->trans.col(0) = world_from_object.translation();
  clip.object->orient.col(0) = LogSO3(world_from_object.linear());
}

bool NothingToCarry(GraspStatus status) {
  return status == GraspStatus::kNothingToGrasp || status == GraspStatus::kNoRoom ||
         status == GraspStatus::kNothingAtPlace || status == GraspStatus::kNoHandle ||
         status == GraspStatus::kStopped;
}

// Mean of world up in the wrist's frame over the first `frames` of a clip.
Eigen::Vector3d MeanUpInWrist(const Clip& clip, const HandModel& hand, int frames) {
  HandState state(hand);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int t = 0; t < frames; ++t) {
    state.SetBody(clip.pose[t], clip.trans.col(t));
    sum += state.WristRotation().transpose() * Eigen::Vector3d::UnitZ();
  }
  return sum / std::max(1, frames);
}

// The feasible clean grasp with the highest total score.
Grasp WorthMost(const HandModel& hand, const GraspReport& report, const FirstGraspOptions& options,
                const SignedDistance& surface) {
  constexpr std::size_t kMaxAsked = 4;
  std::vector<std::pair<double, const Grasp*>> clean;
  for (const GraspReport::Candidate& candidate : report.candidates) {
    if (!candidate.refused.empty()) continue;
    clean.emplace_back(candidate.grasp.score + options.also(candidate.grasp), &candidate.grasp);
  }
  std::ranges::stable_sort(clean, std::greater(), &std::pair<double, const Grasp*>::first);
  std::size_t chosen = 0;
  while (options.serves && chosen < std::min(clean.size(), kMaxAsked) &&
         !options.serves(*clean[chosen].second)) {
    ++chosen;
  }
  Grasp best = *clean[chosen < std::min(clean.size(), kMaxAsked) ? chosen : 0].second;
  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd in_object =
      best.wrist_from_object.inverse() * evaluation.At(best.fingers.data(), false).Vertices();
  best.metrics = MeasureContact(TriangleMesh{in_object, hand.Surface().Faces()}, surface,
                                {.threads = options.threads});
  return best;
}

}  // namespace

void RequireGraspable(const LoadedObject& object, bool both) {
  RequireHandheld(object);
  constexpr double kLarge_m = 0.25;  // for smaller objects, the search reports this fast enough
  const Eigen::Vector3d extent = Extent(object.mesh);
  const double span = both ? BothHandsOptions{}.max_width_m : OppositionOptions{}.max_width_m;
  if (extent.maxCoeff() < kLarge_m || IsWithinSpan(object.mesh, span)) return;
  throw FitFailure(fmt::format(
      "{}: no part of it is thinner than the {:.0f} cm that {}. It measures {:.1f} x {:.1f} x "
      "{:.1f} cm: check its unit (--object-scale){}",
      object.name, 100.0 * span, both ? "two hands can hold between them" : "a hand can span",
      100.0 * extent.x(), 100.0 * extent.y(), 100.0 * extent.z(),
      !both && IsWithinSpan(object.mesh, BothHandsOptions{}.max_width_m)
          ? ", or hold it between both hands (--hand both)"
          : ""));
}

FirstGrasp GraspInFirstFrame(const HandModel& hand, const PreparedObject& object,
                             const BodySurface& body, int held_frames,
                             const FirstGraspOptions& options, Clip& clip,
                             const GraspProgress& progress) {
  HandState state(hand);
  state.SetBody(clip.pose[0], clip.trans.col(0));
  GraspOptions search;
  search.seed = options.seed;
  search.style = options.style;
  search.use = options.use;
  search.place = options.place;
  search.threads = options.threads;
  search.best_only = !options.also;
  search.up_in_wrist = {state.WristRotation().transpose() * Eigen::Vector3d::UnitZ()};
  search.mean_up_in_wrist = MeanUpInWrist(clip, hand, held_frames);
  // A hand is about 20 cm long: obstacles beyond that plus the object's size cannot be met.
  const TriangleMesh& mesh = object.object.mesh;
  const DistanceGrid& grid = *object.fit.distance;
  const double reach_m = 0.2 + Extent(mesh).norm();
  search.obstacles_in_wrist = BodyAroundWrist(clip, body, hand.HandSide(), reach_m);
  GraspReport report;
  FirstGrasp first;
  first.made = true;
  first.one = CloseHand(hand, mesh, object.solid.distance, grid, search, &report, progress);
  if (options.also && report.status == GraspStatus::kFound) {
    first.one = WorthMost(hand, report, options, object.solid.distance);
  }
  const Grasp& grasp = *first.one;
  first.use = report.use;
  // A receiving hand has to touch the object; report other collisions before that.
  first.through_body = grasp.blocked;
  if (held_frames < clip.NumFrames()) {
    const Clip held = Slice(clip, 0, held_frames);
    constexpr int kFrames = 8;
    const std::vector<Eigen::Matrix3Xd> around =
        BodyAroundWrist(held, body, hand.HandSide(), reach_m, kFrames, false);
    first.through_body = WristObstacles(around).ShareBlocked(grid, grasp.wrist_from_object);
  }
  first.status = std::string(Describe(report.status));
  first.search_ms = report.search_ms + report.closing_ms + report.refinement_ms;
  if (NothingToCarry(report.status)) return first;
  // The least bad grasp need not be at the requested place.
  if (options.place && report.status != GraspStatus::kFound) {
    first.status = fmt::format("{} at the requested place (best try: {})", Describe(report.status),
                               report.candidates.front().refused);
    return first;
  }
  first.clean = report.status != GraspStatus::kNoCleanGrasp;
  if (!first.clean) {
    first.warnings.push_back(
        fmt::format("{}; using the best rejected grasp", Describe(report.status)));
  }
  // Small vessels cannot be held off the regions above and below them.
  constexpr double kMaxInKeepFree = 0.03;
  const bool keeps_free = report.use == GraspUse::kCamera || report.use == GraspUse::kPhone ||
                          (options.place && !options.place->Avoided().empty());
  if (keeps_free && grasp.in_keep_free > kMaxInKeepFree) {
    first.warnings.push_back(
        fmt::format("{:.0f} % of the hand's skin is where the {} is to be kept free; try another "
                    "--seed, --region or --at",
                    100.0 * grasp.in_keep_free, object.object.name));
  }
  PlaceObject(ObjectInWorld(grasp, state.WristRotation(), state.WristPosition()), clip);
  SetFingers(clip.pose[0], hand.HandSide(), grasp.fingers);
  first.found = true;
  return first;
}

GivenGrasp ReadGivenGrasp(const std::string& file, std::shared_ptr<const BodyModel> body,
                          std::optional<Side> side) {
  ImportFileOptions import;
  import.parameters.body = std::move(body);
  import.parameters.up = UpAxis::kZ;
  import.parameters.keep_ground = true;
  const LoadedClip loaded = LoadClip(file, std::move(import));
  const Clip& clip = loaded.clip;
  GivenGrasp given;
  given.source = file;
  const auto held =
      std::ranges::find_if(clip.holding_hand, [](std::uint8_t bits) { return bits != 0; });
  const bool labeled = held != clip.holding_hand.end();
  const auto frame = labeled ? static_cast<std::size_t>(held - clip.holding_hand.begin()) : 0;
  given.side = side.value_or(labeled && *held == kHoldsLeft ? Side::kLeft : Side::kRight);
  if (const std::optional<Side> lone = loaded.body.model->LoneHand()) {
    if (side && *lone != *side) {
      throw Error(file, fmt::format("is a grasp of the {} hand", SideName(*lone)),
                  fmt::format("Give --hand {}", SideName(*lone)));
    }
    given.side = *lone;
  }
  const HandModel hand(loaded.body.model, loaded.body.betas, given.side);
  HandState state(hand);
  state.SetBody(clip.pose[frame], clip.trans.col(static_cast<Eigen::Index>(frame)));
  given.fingers = FingersOf(clip.pose[frame], given.side);
  given.wrist_from_object = state.WorldFromWrist().inverse();
  if (clip.object) {
    given.wrist_from_object = given.wrist_from_object * ObjectPoses(clip)[frame];
  } else {
    given.warnings.push_back(
        fmt::format("{} has no object pose: its hand is taken to be in the object's frame", file));
  }
  return given;
}

FirstGrasp TakeGivenGrasp(const HandModel& hand, const PreparedObject& object,
                          const GivenGrasp& given, int threads, Clip& clip) {
  constexpr double kMaxAway_mm = 5.0, kMaxDeep_mm = 10.0;
  FirstGrasp first;
  first.made = true;
  first.found = true;
  first.status = "given by " + given.source;
  first.warnings = given.warnings;
  SetFingers(clip.pose[0], hand.HandSide(), given.fingers);
  HandState state(hand);
  state.SetBody(clip.pose[0], clip.trans.col(0));
  PlaceObject(state.WorldFromWrist() * given.wrist_from_object, clip);
  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd in_object =
      given.wrist_from_object.inverse() * evaluation.At(given.fingers.data(), false).Vertices();
  first.given = MeasureContact(TriangleMesh{in_object, hand.Surface().Faces()},
                               object.solid.distance, {.threads = threads});
  if (first.given->min_distance_mm > kMaxAway_mm) {
    first.clean = false;
    first.warnings.push_back(
        fmt::format("the hand of {} is {:.0f} mm from {}: check that object and unit match",
                    given.source, first.given->min_distance_mm, object.object.name));
  } else if (first.given->max_penetration_mm > kMaxDeep_mm) {
    first.clean = false;
    first.warnings.push_back(fmt::format("the hand of {} is {:.0f} mm deep in {}", given.source,
                                         first.given->max_penetration_mm, object.object.name));
  }
  return first;
}

FirstGrasp HoldInFirstFrame(const HandModel& right, const HandModel& left,
                            const PreparedObject& object, const BodySurface& body,
                            const FirstGraspOptions& options, Clip& clip) {
  BothHandsOptions search;
  search.seed = options.seed;
  search.threads = options.threads;
  search.place = options.place;
  const Eigen::Vector3d trans = clip.trans.col(0);
  FirstGrasp first;
  first.made = true;
  first.both = HoldInBothHands(right, left, body, clip.pose[0], trans, object.object.mesh,
                               *object.fit.distance, search);
  const BothHandsGrasp& grasp = *first.both;
  first.status = std::string(Describe(grasp.status));
  if (grasp.status != GraspStatus::kFound) return first;
  first.poses.emplace();
  for (int h = 0; h < 2; ++h) {
    const HandModel& hand = h == 0 ? right : left;
    HandState state(hand);
    state.SetBody(grasp.pose, trans);
    (*first.poses)[h] = {FingersOf(grasp.pose, hand.HandSide()),
                         OffsetTo(hand, state.WorldFromWrist(), trans, clip.pose[0])};
  }
  PlaceObject(grasp.world_from_object, clip);
  first.found = true;
  return first;
}

Eigen::Vector3d PalmOf(Side side, const Eigen::Isometry3d& wrist) {
  constexpr double kFromWrist_m = 0.08;
  return wrist.translation() + kFromWrist_m * FingerDirection(side, wrist.linear());
}

Eigen::VectorXd PalmTracks::Speed(Side side) const {
  const Eigen::Matrix3Xd& palm = Of(side);
  const auto half = std::max<Eigen::Index>(1, std::lround(0.04 * frame_rate));
  Eigen::VectorXd speed(palm.cols());
  for (Eigen::Index t = 0; t < palm.cols(); ++t) {
    const Eigen::Index from = std::max<Eigen::Index>(0, t - half);
    const Eigen::Index to = std::min(palm.cols() - 1, t + half);
    const double frames = static_cast<double>(std::max<Eigen::Index>(1, to - from));
    speed(t) = frame_rate * (palm.col(to) - palm.col(from)).norm() / frames;
  }
  return speed;
}

PalmTracks TrackPalms(const Clip& clip, const Eigen::Matrix3Xd& rest_joints) {
  PalmTracks tracks;
  tracks.frame_rate = clip.frame_rate;
  for (Eigen::Matrix3Xd& palm : tracks.at) palm.resize(3, clip.NumFrames());
  Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    tracks.at[0].col(t) = PalmOf(Side::kRight, state.WorldFromJoint(kRightWrist));
    tracks.at[1].col(t) = PalmOf(Side::kLeft, state.WorldFromJoint(kLeftWrist));
    tracks.head.push_back(state.WorldFromJoint(kHead));
    forward += state.world_rotation[kSpine3].col(2);
  }
  forward.z() = 0.0;
  if (!forward.isZero()) tracks.forward = forward.normalized();
  return tracks;
}

}  // namespace holdfast
