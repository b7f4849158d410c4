// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/rotation.h"
#include "solver/carry/first_grasp.h"
#include "solver/carry/standing_grasp.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
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
               "right, left, both: the object between them; auto: the right, or the only one of a "
               "MANO model");
  AddStyleOption(table, "style", search.style,
                 "power, precision, handle (fingers through it), or auto: the best of all, by its "
                 "handle what has one");
  AddUseOption(table, search.use);
  table.Number("object_scale", "", job.object_scale, kPositive,
               "Multiplies the object's coordinates (0.001 for millimetres)");
  table.Number("closings", "", search.closings, {1, 100'000},
               "Placements that the fingers are closed for");
  table.Number("refinements", "", search.refinements, {1, 100'000}, "Closed hands that are refined");
  table.Number("friction", "", search.friction, {0.01, 2.0},
               "Friction coefficient of skin on the object");
  table.Number("upright", "", search.upright_weight, kNonNegative,
               "How much an object that stays upright is preferred");
  table.Number("apart", "cm", ScaledNumber{&job.many.apart_m, 0.01}, kNonNegative,
               "Of many grasps: distinct wrists are so far apart, cm, in the object's frame ...");
  table.Number("apart_angle", "deg", ScaledNumber{&job.many.apart_rad, kDegree}, {0.0, 180.0},
               "... or turned by this much, degrees");
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
  throw FitFailure(fmt::format("{}. {}; a hand spans about 10 cm. {}, or try --closings {} --seed {}",
                               why, MeasuresText(object.mesh),
                               PlaceRemedy(options.place != nullptr), 4 * options.closings,
                               options.seed + 1));
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
  DistanceGridOptions grid_options;
  grid_options.threads = options.threads;
  const DistanceGrid grid(surface, grid_options);
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
