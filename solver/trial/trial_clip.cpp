// SPDX-License-Identifier: MIT
#include "solver/trial/trial_clip.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "geometry/score/hand_object_score.h"

namespace holdfast {
namespace {

// Begin and end of the longest run of frames with these bits alone.
std::pair<int, int> LongestRun(const std::vector<std::uint8_t>& holding, std::uint8_t bits) {
  std::pair<int, int> best{0, 0};
  const int count = static_cast<int>(holding.size());
  for (int begin = 0, end = 0; begin < count; begin = end + 1) {
    for (end = begin; end < count && holding[static_cast<std::size_t>(end)] == bits;) ++end;
    if (end - begin > best.second - best.first) best = {begin, end};
  }
  return best;
}

// Who is tried, and when; begin is end where nobody is.
ClipTrial ChooseHold(const ClipScene& scene, const SignedDistance& distance) {
  const Clip& clip = scene.clip;
  ClipTrial trial;
  if (!clip.holding_hand.empty()) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const auto run =
          LongestRun(clip.holding_hand, side == Side::kRight ? kHoldsRight : kHoldsLeft);
      if (!scene.body->HasHand(side) || run.second - run.first <= trial.end - trial.begin) continue;
      trial.side = side;
      std::tie(trial.begin, trial.end) = run;
    }
    return trial;
  }
  trial.end = clip.NumFrames();
  if (const std::optional<Side> lone = scene.body->LoneHand()) {
    trial.side = *lone;
  } else {
    const auto away = [&](Side side) {
      return MeanDistance(clip, HandModel(scene.body, scene.betas, side), distance,
                          clip.NumFrames());
    };
    trial.side = away(Side::kLeft) < away(Side::kRight) ? Side::kLeft : Side::kRight;
  }
  return trial;
}

nlohmann::json CourseJson(const TrialCourse& course) {
  return {{"holds", course.holds},
          {"touches_at_end", course.touches},
          {"stable", course.stable},
          {"slip_mm", course.slip_mm},
          {"slip_deg", course.slip_deg},
          {"most_slip_mm", course.most_slip_mm},
          {"most_slip_deg", course.most_slip_deg}};
}

}  // namespace

std::optional<ClipTrial> TryClip(const ClipScene& scene, const TrialProtocol& protocol) {
  RequirePhysics();
  if (!scene.clip.object || !scene.object) return std::nullopt;
  const SignedDistance distance(*scene.object);
  ClipTrial trial = ChooseHold(scene, distance);
  if (trial.begin == trial.end) return std::nullopt;
  const HandModel hand(scene.body, scene.betas, trial.side);
  HandState state(hand);
  HandMotion motion;
  motion.frame_rate = scene.clip.frame_rate;
  for (int t = trial.end; t-- > trial.begin;) {  // ends in the first frame, which is tried
    state.SetBody(scene.clip.pose[t], scene.clip.trans.col(t));
    motion.world_from_wrist.push_back(state.WorldFromWrist());
    motion.fingers.push_back(FingersOf(scene.clip.pose[t], trial.side));
  }
  std::ranges::reverse(motion.world_from_wrist);
  std::ranges::reverse(motion.fingers);
  state.Evaluate(motion.fingers.front(), false);
  const TrialSolid solid = MakeTrialSolid(*scene.object, distance, protocol);
  trial.pieces = static_cast<int>(solid.pieces.size());
  trial.excess_mm = solid.excess_mm;
  trial.hold = TryHold(state, scene.clip.object->Pose(trial.begin), solid, distance, protocol,
                       trial.end - trial.begin > 1 ? &motion : nullptr);
  return trial;
}

nlohmann::json TrialJson(const ClipTrial& trial) {
  const HoldTrial& hold = trial.hold;
  nlohmann::json json = {{"hand", SideName(trial.side)},
                         {"first_frame", trial.begin},
                         {"frames", trial.end - trial.begin},
                         {"held_directions", hold.Held()},
                         {"worst_slip_mm", hold.WorstSlip_mm()},
                         {"worst_slip_deg", hold.WorstSlip_deg()},
                         {"mass_kg", hold.mass_kg},
                         {"grip_N", hold.grip_N},
                         {"pressing_contacts", hold.pressing},
                         {"object_pieces", trial.pieces},
                         {"object_pieces_reach_out_mm", trial.excess_mm},
                         {"settling", CourseJson(hold.settling)},
                         {"clip", hold.clip ? CourseJson(*hold.clip) : nlohmann::json(nullptr)}};
  for (int k = 0; k < kTrialDirections; ++k) {
    nlohmann::json course = CourseJson(hold.directions[static_cast<std::size_t>(k)]);
    course["gravity"] = TrialDirectionName(k);
    json["directions"].push_back(std::move(course));
  }
  return json;
}

nlohmann::json TrialProtocolJson(const TrialProtocol& protocol) {
  const auto numbers = [](const Eigen::Vector3d& v) {
    return std::vector<double>(v.begin(), v.end());
  };
  return {{"engine", "MuJoCo"},
          {"density_kg_m3", protocol.density_kg_m3},
          {"mass_kg", {protocol.least_mass_kg, protocol.most_mass_kg}},
          {"gravity_m_s2", protocol.gravity_m_s2},
          {"friction", protocol.scene.friction},
          {"torsional_friction_m", protocol.scene.torsion_m},
          {"touch_mm", 1e3 * protocol.touch_m},
          {"grip_weights", protocol.grip_weights},
          {"least_grip_N", protocol.least_grip_N},
          {"settle_s", protocol.settle_s},
          {"settle_drag_per_s", protocol.settle_drag_per_s},
          {"hold_s", protocol.hold_s},
          {"limit_mm", protocol.most_mm},
          {"limit_deg", protocol.most_deg},
          {"time_step_s", protocol.scene.step_s},
          {"joint_stiffness_Nm_rad", numbers(protocol.fingers.stiffness_Nm)},
          {"joint_torque_limit_Nm", numbers(protocol.fingers.torque_limit_Nm)},
          {"joint_side_stiffness_Nm_rad", protocol.fingers.side_stiffness_Nm}};
}

std::string TrialText(const ClipTrial& trial) {
  const HoldTrial& hold = trial.hold;
  std::string text = fmt::format(
      "{} hand, {:.0f} g, grip {:.0f} N: holds in {} of 6 directions of gravity (slip at most "
      "{:.1f} mm, {:.1f} deg",
      SideName(trial.side), 1e3 * hold.mass_kg, hold.grip_N, hold.Held(), hold.WorstSlip_mm(),
      hold.WorstSlip_deg());
  text += fmt::format("; settled by {:.1f} mm, {:.1f} deg)", hold.settling.slip_mm,
                      hold.settling.slip_deg);
  if (hold.clip) {
    text += fmt::format(", {} along the clip (slip {:.1f} mm at the end, {:.1f} mm at most)",
                        hold.clip->holds ? "holds" : "is lost", hold.clip->slip_mm,
                        hold.clip->most_slip_mm);
  }
  return text;
}

}  // namespace holdfast
