// SPDX-License-Identifier: MIT
#include "solver/transfer/transfer_json.h"

#include <string>

#include "geometry/rotation.h"

namespace holdfast {

nlohmann::json MapJson(const SurfaceMapReport& map) {
  return {{"method", std::string(MethodName(map.method))},
          {"turned_deg", map.turned_deg},
          {"scale", {map.scale.x(), map.scale.y(), map.scale.z()}},
          {"residual_mm", map.residual_mm},
          {"missed_mm", map.missed_mm},
          {"stretch_median", map.stretch_median},
          {"stretch_p95", map.stretch_most},
          {"alike", map.alike}};
}

nlohmann::json TransferredHoldsJson(const std::vector<TransferredHold>& holds) {
  nlohmann::json list = nlohmann::json::array();
  for (const TransferredHold& hold : holds) {
    const CarriedGrasp& grasp = hold.grasp;
    list.push_back({{"hand", std::string(SideName(hold.side))},
                    {"begin", hold.begin},
                    {"end", hold.end},
                    {"frame", hold.frame},
                    {"clean", grasp.clean},
                    {"searched", grasp.searched},
                    {"refused", grasp.refused},
                    {"contacts", grasp.contacts},
                    {"contacts_off_mm", grasp.contact_off_mm},
                    {"hand_in_object_mm", grasp.hand_in_object_mm},
                    {"object_in_hand_mm", grasp.object_in_hand_mm},
                    {"fingers_touching", grasp.fingers_touching},
                    {"fingers_touched_before", grasp.fingers_touched},
                    {"wrist_moved_mm", 1e3 * grasp.wrist_shift_m},
                    {"wrist_turned_deg", grasp.wrist_turn_rad / kDegree}});
  }
  return list;
}

nlohmann::json FollowingJson(const TransferReport& report) {
  return {{"kept", report.kept_wrists ? "wrists" : "object"},
          {"leg_ratio", report.body.leg_ratio},
          {"hand_ratio", report.body.fingers_ratio},
          {"ankle_missed_mm", 1e3 * report.body.ankle_missed_m},
          {"pelvis_sink_mm", 1e3 * report.body.sink_m},
          {"stands_off_mm", 1e3 * report.arms.step_m},
          {"arm_shortfall_mm", 1e3 * report.arms.shortfall_m},
          {"wrist_moved_mean_mm", 1e3 * report.arms.wrist_moved_mean_m},
          {"wrist_moved_max_mm", 1e3 * report.arms.wrist_moved_max_m}};
}

}  // namespace holdfast
