// SPDX-License-Identifier: MIT
#include "solver/carry/carry_json.h"

#include <algorithm>
#include <numbers>

namespace holdfast {

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
      entry["grasp"] = {
          {"clean", transfer.found},
          {"method", MethodName(transfer.method)},
          {"refused", transfer.refused},
          {"wrist_correction_mm", 1e3 * transfer.correction_m},
          {"wrist_correction_deg", transfer.correction_rad * 180.0 / std::numbers::pi},
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
          {"wrist_shift_mean_mm", 1e3 * report.shift_mean_m},
          {"wrist_shift_max_mm", 1e3 * report.shift_max_m},
          {"acceleration_ratio", report.acceleration_ratio}};
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
  return {{"holds", holds}, {"rests", rests}};
}

}  // namespace holdfast
