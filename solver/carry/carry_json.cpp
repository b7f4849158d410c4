// SPDX-License-Identifier: MIT
#include "solver/carry/carry_json.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <ceres/types.h>
#include <ceres/version.h>
#include <fmt/format.h>

#include "geometry/conventions/hand_evidence.h"
#include "geometry/rotation.h"
#include "solver/fit/frame_fitter.h"

namespace holdfast {
namespace {

template <typename Frame, typename Get>
nlohmann::json Column(const std::vector<Frame>& frames, const Get& get) {
  nlohmann::json values = nlohmann::json::array();
  for (const Frame& frame : frames) values.push_back(get(frame));
  return values;
}

}  // namespace

nlohmann::json FirstGraspJson(const FirstGrasp& first) {
  nlohmann::json json = {{"made", first.made}};
  if (!first.made) return json;
  json["status"] = first.status;
  if (first.one) {
    const Grasp& grasp = *first.one;
    json.update({{"style", StyleName(grasp.style)},
                 {"use", UseName(first.use)},
                 {"skin_in_keep_free_ratio", grasp.in_keep_free},
                 {"score", grasp.score},
                 {"wrench_quality", grasp.wrench_quality},
                 {"skin_in_object_mm", grasp.max_penetration_mm},
                 {"object_in_hand_mm", grasp.object_in_hand_mm},
                 {"frames_through_body_ratio", first.through_body},
                 {"search_ms", first.search_ms}});
  }
  if (first.given) {
    json["min_distance_mm"] = first.given->min_distance_mm;
    json["skin_in_object_mm"] = first.given->max_penetration_mm;
  }
  if (first.both && first.found) {
    json["width_mm"] = 1000.0 * first.both->width_m;
    json["body_in_object_mm"] = first.both->in_body_mm;
    for (int h = 0; h < 2; ++h) {
      json[h == 0 ? "right" : "left"] = {
          {"skin_in_object_mm", first.both->hands[h].max_penetration_mm},
          {"wrist_shift_mm", first.both->wrist_shift_mm[h]},
          {"wrist_turn_deg", first.both->wrist_turn_deg[h]}};
    }
  }
  return json;
}

nlohmann::json WeightsJson(const FitOptions& options) {
  nlohmann::json weights;
  for (const EnergyTermInfo& info : EnergyTerms()) {
    weights[fmt::format("lambda_{}", info.name)] = options.*info.weight;
  }
  return weights;
}

nlohmann::json SolverJson(const FitOptions& options) {
  const ceres::Solver::Options solver = FrameSolverOptions(options);
  return {{"library", "Ceres " CERES_VERSION_STRING},
          {"minimizer", ceres::TrustRegionStrategyTypeToString(solver.trust_region_strategy_type)},
          {"linear_solver", ceres::LinearSolverTypeToString(solver.linear_solver_type)},
          {"max_iterations", solver.max_num_iterations},
          {"step_tolerance", solver.parameter_tolerance},
          {"function_tolerance", solver.function_tolerance}};
}

nlohmann::json ProtocolJson(const ContactProtocol& protocol, const Solid& object,
                            const HandModel& hand) {
  return {
      {"penetration",
       "depth of hand vertices inside the object and of object vertices inside the hand (closed "
       "at the wrist), exact signed distance to full-resolution meshes; mean_penetration: of hand "
       "vertices alone"},
      {"contact", "a hand vertex is in contact when |signed distance| is below the threshold"},
      {"contact_threshold_mm", protocol.contact_threshold_mm},
      {"intersection_volume", "voxel centers inside both object and hand (closed at the wrist)"},
      {"voxel_mm", protocol.voxel_mm},
      {"hand_vertices", hand.NumVertices()},
      {"object_vertices", object.mesh.NumVertices()},
      {"inside_by", object.IsClosed() ? "pseudonormal" : "winding number"}};
}

nlohmann::json DrinkJson(const std::optional<DrinkReport>& served, const DrinkMeasures& drunk) {
  if (!served) return nullptr;
  const DrinkReport& drink = *served;
  return {{"hand", SideName(drink.times.side)},
          {"lift_frame", drink.times.lift},
          {"drink_frame", drink.times.drink},
          {"put_down_frame", drink.times.put_down},
          {"grasp_status", Describe(drink.status)},
          {"wrist_shift_max_mm", 1e3 * drink.wrist_shift_m},
          {"wrist_turn_max_deg", drink.wrist_turn_rad / kDegree},
          {"head_turn_max_deg", drink.head.turned_rad / kDegree},
          {"rim_from_mouth_mm", 1e3 * drunk.rim_from_mouth_m},
          {"tilt_deg", drunk.tilt_rad / kDegree},
          {"lean_on_table_deg", drunk.lean_rad / kDegree},
          {"neck_tilt_max_deg", drunk.neck_rad / kDegree}};
}

nlohmann::json ContactJson(const ContactScore& contact) {
  const auto or_null = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json();
  };
  return {{"frames_in_contact_ratio", or_null(contact.contact_frames_ratio)},
          {"contact_ratio", or_null(contact.contact_ratio)},
          {"frames_deeper_than_2_mm", contact.deep_frames},
          {"max_penetration_depth_mm", contact.penetration_max_mm},
          {"mean_max_penetration_depth_mm", contact.penetration_mean_max_mm},
          {"mean_penetration_depth_mm", contact.penetration_mean_mm},
          {"object_in_hand_max_mm", contact.object_in_hand_max_mm},
          {"mean_intersection_volume_cm3", contact.voxel_volume_cm3}};
}

nlohmann::json FitSummaryJson(const FitResult& fit, const ContactScore& contact) {
  std::vector<double> solve_ms, iterations;
  int failed = 0, at_limit = 0;
  for (const FrameReport& frame : fit.frames) {
    if (frame.stop == StopReason::kGiven || frame.stop == StopReason::kResting) continue;
    solve_ms.push_back(frame.solve_ms);
    iterations.push_back(frame.iterations);
    failed += frame.stop == StopReason::kFailed;
    at_limit += frame.stop == StopReason::kIterationLimit;
  }
  nlohmann::json summary = ContactJson(contact);
  summary.update({{"frames", fit.frames.size()},
                  {"contact_pairs", fit.num_contact_pairs},
                  {"frames_failed", failed},
                  {"frames_at_iteration_limit", at_limit},
                  {"solve_ms_median", Median(solve_ms)},
                  {"iterations_median", Median(iterations)}});
  return summary;
}

nlohmann::json FitFramesJson(const FitResult& fit, const ContactScore& contact,
                             const ClearanceReport& clearance) {
  using F = FrameReport;
  using B = ClearanceReport::Frame;
  using C = ContactScore::Frame;
  const auto& frames = fit.frames;
  nlohmann::json columns = {
      {"wrist_offset_mm", Column(frames, [](const F& f) { return 1000.0 * f.wrist_offset_m; })},
      {"energy_total", Column(frames, [](const F& f) { return f.energy_total; })},
      {"iterations", Column(frames, [](const F& f) { return f.iterations; })},
      {"solve_ms", Column(frames, [](const F& f) { return f.solve_ms; })},
      {"stop", Column(frames, [](const F& f) { return StopReasonName(f.stop); })},
      {"contact_ratio", Column(contact.frames, [](const C& c) { return c.contact_ratio; })},
      {"in_contact", Column(contact.frames, [](const C& c) { return c.in_contact; })},
      {"penetration_depth_mm", Column(contact.frames, [](const C& c) { return c.penetration_mm; })},
      {"mean_penetration_depth_mm",
       Column(contact.frames, [](const C& c) { return c.mean_penetration_mm; })},
      {"intersection_volume_cm3",
       Column(contact.frames, [](const C& c) { return c.voxel_volume_cm3; })}};
  if (!clearance.frames.empty()) {
    columns["depth_in_body_mm"] =
        Column(clearance.frames, [](const B& b) { return 1000.0 * b.depth_m; });
    columns["wrist_shift_mm"] =
        Column(clearance.frames, [](const B& b) { return 1000.0 * b.wrist_shift_m; });
  }
  for (std::size_t k = 0; k < fit.custom_terms.size(); ++k) {
    columns["energy_" + fit.custom_terms[k]] = Column(frames, [&](const F& f) {
      const bool acts = k < f.custom_energies.size() && !std::isnan(f.custom_energies[k]);
      return acts ? nlohmann::json(f.custom_energies[k]) : nlohmann::json();
    });
  }
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (info.metric == nullptr) continue;
    nlohmann::json column = Column(frames, [&](const F& f) { return f.energies[info.term]; });
    // E_s replaces E_d and E_c, in few fits.
    const bool is_off = info.term == EnergyTerm::kSlip &&
                        std::ranges::all_of(column, [](const auto& value) { return value == 0.0; });
    if (!is_off) columns[info.metric] = std::move(column);
  }
  return columns;
}

nlohmann::json SwitchesJson(const HoldLabels& holding, const std::vector<Handover>& handovers) {
  nlohmann::json list = nlohmann::json::array();
  for (const HandSwitch& change : holding.switches) {
    nlohmann::json entry = {{"frame", change.frame},
                            {"from", SideName(change.from)},
                            {"to", SideName(change.to)},
                            {"both_hold_from_frame", change.both_begin},
                            {"both_hold_to_frame", change.both_end},
                            {"confidence", change.confidence}};
    for (const Handover& handover : handovers) {
      if (handover.to != change.to || handover.frame < change.both_begin ||
          handover.frame > std::max(change.frame, change.both_end)) {
        continue;
      }
      const GraspTransfer& transfer = handover.transfer;
      entry["grasp"] = {{"clean", transfer.found},
                        {"method", transfer.method},
                        {"refused", transfer.refused},
                        {"wrist_correction_mm", 1e3 * transfer.correction_m},
                        {"wrist_correction_deg", transfer.correction_rad / kDegree},
                        {"receiver_moved_mm", 1e3 * handover.receiver.moved_m},
                        {"receiver_turned_deg", handover.receiver.turned_rad / kDegree},
                        {"giver_moved_mm", 1e3 * handover.giver.moved_m},
                        {"giver_turned_deg", handover.giver.turned_rad / kDegree},
                        {"hand_overlap_mm", transfer.hand_overlap_mm},
                        {"contacts_outside_place_ratio", transfer.grasp.outside_place},
                        {"skin_in_object_mm", transfer.grasp.max_penetration_mm}};
    }
    list.push_back(std::move(entry));
  }
  return list;
}

nlohmann::json ClearanceJson(const ClearanceReport& report) {
  return {{"moved", report.moved},
          {"held_frames", report.held_frames},
          {"frames_deeper_than_2_mm_before", report.deep_before},
          {"frames_deeper_than_2_mm", report.deep},
          {"max_depth_before_mm", 1e3 * report.worst_before_m},
          {"max_depth_mm", 1e3 * report.worst_m},
          {"worst_frame", report.worst_frame},
          {"worst_part", MeetingPartName(report.worst_part)},
          {"worst_in_table", report.worst_in_table},
          {"wrist_shift_mean_mm", 1e3 * report.shift_mean_m},
          {"wrist_shift_max_mm", 1e3 * report.shift_max_m},
          {"free_wrist_shift_mean_mm", 1e3 * report.free_shift_mean_m},
          {"free_wrist_shift_max_mm", 1e3 * report.free_shift_max_m},
          {"wrist_turn_max_deg", report.turn_max_rad / kDegree},
          {"wrist_turn_max_deg_s", report.turn_speed_max_rad_s / kDegree},
          {"frames_not_adjusted", report.kept},
          {"acceleration_ratio", report.acceleration_ratio}};
}

nlohmann::json HandsJson(const CarriedQuality& quality) {
  return {{"frames_with_finger_jumps", quality.finger_jump_frames},
          {"hand_frames_held", quality.hand_frames},
          {"hand_frames_in_contact", quality.hand_frames_in_contact},
          {"fingertips_touch", quality.tips.touch},
          {"fingertips_beside", quality.tips.beside},
          {"fingertips_inside", quality.tips.inside}};
}

nlohmann::json FingersJson(const std::vector<FingerRepair>& fingers) {
  nlohmann::json list = nlohmann::json::array();
  for (const FingerRepair& hand : fingers) {
    list.push_back({{"hand", SideName(hand.side)},
                    {"move", hand.moves},
                    {"frames_with_jumps", hand.jump_frames},
                    {"rotations_replaced", hand.replaced}});
  }
  return list;
}

nlohmann::json KeptJson(const std::vector<FrameRange>& kept) {
  nlohmann::json list = nlohmann::json::array();
  for (const FrameRange& frames : kept) {
    list.push_back({{"begin", frames.begin}, {"end", frames.end}});
  }
  return list;
}

nlohmann::json HoldsJson(const RefineResult& result) {
  nlohmann::json holds = nlohmann::json::array(), rests = nlohmann::json::array();
  for (const RefinedHold& hold : result.holds) {
    holds.push_back({{"hand", SideName(hold.side)},
                     {"begin", hold.begin},
                     {"end", hold.end},
                     {"rigid", hold.rigid},
                     {"noise_mm", hold.noise_mm},
                     {"movement_mm", hold.movement_mm},
                     {"movement_deg", hold.movement_deg}});
  }
  for (const RefinedRest& rest : result.rests) {
    rests.push_back({{"begin", rest.begin}, {"end", rest.end}, {"height_m", rest.height_m}});
  }
  nlohmann::json touches = nlohmann::json::array();
  for (const RefinedTouch& touch : result.touches) {
    touches.push_back({{"hand", SideName(touch.side)}, {"begin", touch.begin}, {"end", touch.end}});
  }
  return {{"holds", holds}, {"rests", rests}, {"touches", touches}};
}

}  // namespace holdfast
