// SPDX-License-Identifier: MIT
#include "apps/first_grasp.h"

#include <fmt/format.h>

#include "geometry/rotation.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_both.h"
#include "solver/grasp/grasp_candidates.h"
#include "solver/grasp/grasp_obstacles.h"

namespace holdfast::apps {

void RequireGraspable(const LoadedObject& object, bool both) {
  RequireHandheld(object);
  constexpr double kLarge_m = 0.25;  // the search itself says so soon enough of smaller ones
  const Eigen::Vector3d extent = Extent(object.mesh);
  const double span = both ? BothHandsOptions{}.max_width_m : OppositionOptions{}.max_width_m;
  if (extent.maxCoeff() < kLarge_m || IsWithinSpan(object.mesh, span)) return;
  throw FitFailure(fmt::format(
      "{}: nothing of it is thinner than the {:.0f} cm that {}. It measures {:.1f} x {:.1f} x "
      "{:.1f} cm: check its unit (--object-scale){}",
      object.name, 100.0 * span, both ? "two hands hold between them" : "a hand spans",
      100.0 * extent.x(), 100.0 * extent.y(), 100.0 * extent.z(),
      !both && IsWithinSpan(object.mesh, BothHandsOptions{}.max_width_m)
          ? ", or hold it between both hands (--hand both)"
          : ""));
}

bool GraspInFirstFrame(const HandModel& hand, const LoadedObject& object,
                       const SignedDistance& surface, const DistanceGrid& grid,
                       const BodySurface& body, int held_frames, const std::string& style,
                       const std::shared_ptr<const GraspPlace>& place, const CommonOptions& common,
                       Clip& clip, nlohmann::json& summary) {
  HandState state(hand);
  state.SetBody(clip.pose[0], clip.trans.col(0));
  GraspOptions grasp_options;
  grasp_options.seed = common.seed;
  grasp_options.style = StyleByName(style);
  grasp_options.place = place;
  grasp_options.threads = NumThreads(common);
  grasp_options.up_in_wrist = {state.WristRotation().transpose() * Eigen::Vector3d::UnitZ()};
  // A hand is about 20 cm long: nothing farther than that and the object's own size is met.
  const double reach_m = 0.2 + Extent(object.mesh).norm();
  grasp_options.obstacles_in_wrist = BodyAroundWrist(clip, body, hand.HandSide(), reach_m);
  GraspReport report;
  Progress progress(common, "grasp");
  const Grasp grasp =
      CloseHand(hand, object.mesh, surface, grid, grasp_options, &report, [&](double share) {
        progress.Update(static_cast<int>(100 * share), 100);
        return !Interrupted();
      });
  // A hand that takes the object over has to touch it: what else meets it, and before, is told.
  double blocked = grasp.blocked;
  if (held_frames < clip.NumFrames()) {
    const Clip held = Slice(clip, 0, held_frames);
    constexpr int kFrames = 8;
    blocked = ShareBlocked(grid, grasp.wrist_from_object,
                           BodyAroundWrist(held, body, hand.HandSide(), reach_m, kFrames, false));
  }
  summary = {{"made", true},
             {"status", Describe(report.status)},
             {"style", StyleName(grasp.style)},
             {"score", grasp.score},
             {"wrench_quality", grasp.wrench_quality},
             {"skin_in_object_mm", grasp.max_penetration_mm},
             {"object_in_hand_mm", grasp.object_in_hand_mm},
             {"frames_through_body_ratio", blocked},
             {"search_ms", report.search_ms + report.closing_ms + report.refinement_ms}};
  if (place) {
    summary["contacts_outside_place_ratio"] = grasp.outside_place;
    summary["from_point_mm"] = 1000.0 * grasp.from_place_m;
  }
  if (report.status == GraspStatus::kNothingToGrasp || report.status == GraspStatus::kNoRoom ||
      report.status == GraspStatus::kNothingAtPlace || report.status == GraspStatus::kStopped) {
    return false;
  }
  // The least bad grasp need not be where it was asked for.
  if (place && report.status != GraspStatus::kFound) {
    summary["status"] = fmt::format("{} at the place asked for (best try: {})",
                                    Describe(report.status), report.candidates.front().refused);
    return false;
  }
  if (report.status == GraspStatus::kNoCleanGrasp) {
    Note(common,
         fmt::format("warning: {}: the least bad grasp is carried on", Describe(report.status)));
  }
  if (blocked > 0.0) {
    Note(common, fmt::format("warning: the object meets the body in about {:.0f} % of the frames",
                             100.0 * blocked));
  }
  const Eigen::Isometry3d pose = ObjectInWorld(grasp, state.WristRotation(), state.WristPosition());
  clip.object.emplace();
  clip.object->trans.setZero(3, clip.NumFrames());
  clip.object->orient.setZero(3, clip.NumFrames());
  clip.object->trans.col(0) = pose.translation();
  clip.object->orient.col(0) = LogSO3(pose.linear());
  SetFingers(clip.pose[0], hand.HandSide(), grasp.fingers);
  return true;
}

std::optional<std::array<GripPose, 2>> HoldInFirstFrame(
    const HandModel& right, const HandModel& left, const LoadedObject& object,
    const DistanceGrid& grid, const BodySurface& body, const CommonOptions& common, Clip& clip,
    nlohmann::json& summary) {
  BothHandsOptions options;
  options.seed = common.seed;
  options.threads = NumThreads(common);
  const Eigen::Vector3d trans = clip.trans.col(0);
  const BothHandsGrasp grasp =
      HoldInBothHands(right, left, body, clip.pose[0], trans, object.mesh, grid, options);
  summary = {{"made", true}, {"status", Describe(grasp.status)}};
  if (grasp.status != GraspStatus::kFound) return std::nullopt;
  summary["width_mm"] = 1000.0 * grasp.width_m;
  summary["body_in_object_mm"] = grasp.in_body_mm;
  std::array<GripPose, 2> grips;
  for (int h = 0; h < 2; ++h) {
    const HandModel& hand = h == 0 ? right : left;
    HandState state(hand);
    state.SetBody(grasp.pose, trans);
    Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();
    wrist.linear() = state.WristRotation();
    wrist.translation() = state.WristPosition();
    grips[h] = {FingersOf(grasp.pose, hand.HandSide()), OffsetTo(hand, wrist, trans, clip.pose[0])};
    summary[h == 0 ? "right" : "left"] = {{"skin_in_object_mm", grasp.hands[h].max_penetration_mm},
                                          {"wrist_shift_mm", grasp.wrist_shift_mm[h]},
                                          {"wrist_turn_deg", grasp.wrist_turn_deg[h]}};
  }
  clip.object.emplace();
  clip.object->trans.setZero(3, clip.NumFrames());
  clip.object->orient.setZero(3, clip.NumFrames());
  clip.object->trans.col(0) = grasp.world_from_object.translation();
  clip.object->orient.col(0) = LogSO3(grasp.world_from_object.linear());
  return grips;
}

}  // namespace holdfast::apps
