// SPDX-License-Identifier: MIT
#include "solver/transfer/transfer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/handover/hand_passage.h"
#include "solver/handover/holds.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kBlend_s = 0.5;  // before and after the new wrist paths

std::vector<TransferredHold> HoldsIn(const std::vector<std::uint8_t>& holding) {
  std::vector<TransferredHold> holds;
  const auto frames = static_cast<int>(holding.size());
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const auto holds_in = [&](int t) { return (holding[t] & HoldingBit(side)) != 0; };
    for (int t = 0; t < frames; ++t) {
      if (!holds_in(t)) continue;
      TransferredHold hold{side, t, t, t, {}};
      while (t < frames && holds_in(t)) ++t;
      hold.end = t;
      holds.push_back(hold);
    }
  }
  std::ranges::stable_sort(holds, {}, &TransferredHold::begin);
  return holds;
}

// One transfer: hands of both bodies and their objects.
class Transferer {
 public:
  Transferer(const Clip& clip, const ClipBody& from, const PreparedObject& from_object,
             const ClipBody& to, const PreparedObject& to_object, const SurfaceMap& map,
             const TransferHands& hands, const TransferOptions& options, TransferReport& report)
      : clip_(clip),
        from_(from),
        to_(to),
        from_object_(from_object),
        to_object_(to_object),
        map_(map),
        hands_(hands),
        options_(options),
        report_(report),
        carriers_(2) {}

  std::vector<std::unique_ptr<const GraspCarrier>> TakeCarriers() { return std::move(carriers_); }

  Clip Prepare(const Clip* onto) {
    const std::vector<std::uint8_t> holding = WhoHolds();
    report_.holds = HoldsIn(holding);
    for (TransferredHold& hold : report_.holds) CarryHold(hold);
    const bool same_body = from_.model == to_.model && from_.betas.size() == to_.betas.size() &&
                           from_.betas == to_.betas;
    Clip moved = onto != nullptr ? *onto : clip_;
    if (onto == nullptr && !same_body) {
      OntoBody other = OntoOtherBody(clip_, from_, to_);
      moved = std::move(other.clip);
      report_.body = other.report;
    }
    moved.holding_hand = holding;
    const TransferredHold& first = report_.holds.front();
    const bool alone =
        report_.holds.size() == 1 && first.begin == 0 && first.end == clip_.NumFrames();
    report_.kept_wrists = options_.keeps == TransferKeeps::kWrists ||
                          (options_.keeps == TransferKeeps::kAuto && alone && same_body);
    for (int t = 0; t < moved.NumFrames(); ++t) {
      moved.object->SetPose(t, clip_.object->Pose(t) * map_.InPlace().inverse());
    }
    if (report_.kept_wrists) {
      FollowWrists(moved);
    } else {
      ScaleHeights(moved);
      FollowObject(moved);
    }
    for (const TransferredHold& hold : report_.holds) {
      for (int t = hold.begin; t < hold.end; ++t) {
        SetFingers(moved.pose[t], hold.side, hold.grasp.hold.fingers);
      }
    }
    moved.object->name = to_object_.object.name;
    moved.object->surface = nullptr;
    Tell(alone, same_body);
    return moved;
  }

 private:
  static std::size_t IndexOf(Side side) { return side == Side::kRight ? 0 : 1; }

  std::vector<std::uint8_t> WhoHolds() const {
    std::vector<std::uint8_t> holding = clip_.holding_hand;
    if (holding.empty()) {
      holding = FindHolds(clip_, hands_.from_hands[0], hands_.from_hands[1],
                          *from_object_.fit.distance, options_.carry.threads)
                    .hands;
    }
    if (std::ranges::all_of(holding, [](std::uint8_t bits) { return bits == 0; })) {
      throw Error("the clip", "has an object that no hand holds: there is nothing to transfer",
                  "Fit the object to it first ('holdfast fit')");
    }
    std::uint8_t all = 0;
    for (const std::uint8_t bits : holding) all |= bits;
    RequireHands(*from_.model, all);
    return holding;
  }

  // Transfers the grasp of the frame with most contacts, among a few.
  void CarryHold(TransferredHold& hold) {
    constexpr int kLooks = 9;
    const HandModel& hand = hands_.from_hands[IndexOf(hold.side)];
    HandState state(hand);
    int most = -1;
    HandOnObject held;
    Vector3d up = Vector3d::UnitZ();
    for (int k = 0; k < kLooks; ++k) {
      const int t = hold.begin + (hold.end - 1 - hold.begin) * k / (kLooks - 1);
      state.SetBody(clip_.pose[t], clip_.trans.col(t));
      const FingerPose fingers = FingersOf(clip_.pose[t], hold.side);
      state.Evaluate(fingers, false);
      const Eigen::Matrix3Xd in_object = clip_.object->Pose(t).inverse() * state.Vertices();
      int contacts = 0;
      for (Eigen::Index i = 0; i < in_object.cols(); ++i) {
        contacts += from_object_.fit.distance->Linear(in_object.col(i)) < kCarriedTouch_m;
      }
      if (contacts <= most) continue;
      most = contacts;
      hold.frame = t;
      held = {fingers, state.WorldFromWrist().inverse() * clip_.object->Pose(t)};
      up = state.WristRotation().transpose() * Vector3d::UnitZ();
    }
    std::unique_ptr<const GraspCarrier>& carrier = carriers_[IndexOf(hold.side)];
    if (!carrier) {
      carrier = std::make_unique<const GraspCarrier>(
          *hands_.carrying[IndexOf(hold.side)], from_object_, to_object_, map_, options_.search,
          options_.carry.seed, options_.carry.threads);
    }
    hold.grasp = carrier->Carry(held, up);
  }

  // Scales the heights of the object's bottom and of the table's top by those of the bodies, so
  // that a cup reaches the mouth and a table has the same height on the body.
  void ScaleHeights(Clip& moved) const {
    const double more = report_.body.height_ratio - 1.0;
    if (more == 0.0) return;
    for (int t = 0; t < moved.NumFrames(); ++t) {
      const Isometry3d pose = clip_.object->Pose(t);
      moved.object->trans(2, t) += more * (pose * from_object_.fit.vertices).row(2).minCoeff();
      if (!moved.table) continue;
      const TriangleMesh* const table = TableMesh(clip_);
      const Isometry3d place = clip_.table->Pose(t);
      moved.table->trans(2, t) +=
          more * (table == nullptr ? place.translation().z()
                                   : (place * table->vertices).row(2).maxCoeff());
    }
  }

  // During a hold the object moves with its wrist; otherwise it keeps its trajectory.
  void FollowWrists(Clip& moved) const {
    for (const TransferredHold& hold : report_.holds) {
      HandState state(hands_.to_hands[IndexOf(hold.side)]);
      for (int t = hold.begin; t < hold.end; ++t) {
        state.SetBody(moved.pose[t], moved.trans.col(t));
        moved.object->SetPose(t, state.WorldFromWrist() * hold.grasp.hold.wrist_from_object);
      }
    }
  }

  // The second object has the first one's trajectory at heights of the second body, and wrists move
  // to it.
  void FollowObject(Clip& moved) {
    std::vector<WristPath> paths;
    for (const TransferredHold& hold : report_.holds) {
      WristPath path{hold.side, hold.begin, hold.end, {}};
      for (int t = hold.begin; t < hold.end; ++t) {
        path.wrist.push_back(moved.object->Pose(t) * hold.grasp.hold.wrist_from_object.inverse());
      }
      paths.push_back(std::move(path));
    }
    report_.arms = BringWrists(to_, paths, kBlend_s, moved);
  }

  void Tell(bool alone, bool same_body) {
    const SurfaceMapReport& map = map_.Report();
    if (!map.alike) {
      report_.warnings.push_back(
          fmt::format("{} differs much in shape from {}: the map stretches by up to {:.1f}, leaves "
                      "{:.1f} mm between the surfaces and misses parts by {:.1f} mm",
                      to_object_.object.name, from_object_.object.name, map.stretch_most,
                      map.residual_mm, map.missed_mm));
    }
    for (const TransferredHold& hold : report_.holds) {
      const CarriedGrasp& grasp = hold.grasp;
      if (grasp.clean && !grasp.searched) continue;
      report_.warnings.push_back(fmt::format(
          "frames {}-{}: the {} hand can't keep its contacts ({}): {}", hold.begin, hold.end - 1,
          SideName(hold.side), grasp.refused,
          grasp.searched ? fmt::format("using a new grasp near them, {:.0f} mm and {:.0f} deg away",
                                       1e3 * grasp.wrist_shift_m, grasp.wrist_turn_rad / kDegree)
                         : "no clean grasp was found near them, so the mapped grasp is used"));
    }
    if (alone && !same_body && !report_.kept_wrists) {
      report_.warnings.push_back(
          "the object keeps its trajectory in the world, with heights scaled by those of the "
          "bodies; "
          "with --keep wrists it follows the body");
    }
    if (report_.arms.shortfall_m > 0.005) {
      report_.warnings.push_back(
          fmt::format("arms are too short: the hand deviates from its path by up to {:.0f} mm",
                      1e3 * report_.arms.shortfall_m));
    }
  }

  const Clip& clip_;
  const ClipBody &from_, &to_;
  const PreparedObject &from_object_, &to_object_;
  const SurfaceMap& map_;
  const TransferHands& hands_;
  const TransferOptions& options_;
  TransferReport& report_;
  std::vector<std::unique_ptr<const GraspCarrier>> carriers_;  // right, left
};

// Makes hands approach and leave without passing through the object, and measures again.
void ClearWays(const Clip& prepared, const TransferHands& hands, const PreparedObject& object,
               const TransferOptions& options, TransferReport& report) {
  std::vector<const HandModel*> holding;
  for (const HandModel& hand : hands.to_hands) {
    if ((report.carried.held_by & HoldingBit(hand.HandSide())) != 0) holding.push_back(&hand);
  }
  ClearPassages(prepared, holding, *object.fit.distance, options.carry.fit.release_s,
                report.carried.clip);
  ContactProtocol protocol = options.carry.protocol;
  protocol.threads = options.carry.threads;
  report.carried.contact = ScoreContact(MeasureHands(
      report.carried.clip, holding, report.carried.holding.hands, object.solid, protocol));
}

}  // namespace

TransferHands::TransferHands(const ClipBody& from, const ClipBody& to) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    from_hands.emplace_back(from.model, from.betas, side);
    to_hands.emplace_back(to.model, to.betas, side);
  }
  for (std::size_t h = 0; h < 2; ++h) {
    const bool there = from_hands[h].NumVertices() > 0 && to_hands[h].NumVertices() > 0;
    carrying.push_back(there ? std::make_unique<const CarryingHand>(from_hands[h], to_hands[h])
                             : nullptr);
  }
}

Clip PrepareTransfer(const Clip& clip, const ClipBody& from, const PreparedObject& from_object,
                     const ClipBody& to, const PreparedObject& to_object, const SurfaceMap& map,
                     const TransferHands& hands, const TransferOptions& options,
                     TransferReport& report, const Clip* onto,
                     std::vector<std::unique_ptr<const GraspCarrier>>* carriers) {
  if (!clip.object) {
    throw Error("the clip", "has no object: there is nothing to transfer",
                "Fit one to it first ('holdfast fit')");
  }
  Transferer transferer(clip, from, from_object, to, to_object, map, hands, options, report);
  Clip prepared = transferer.Prepare(onto);
  if (carriers != nullptr) *carriers = transferer.TakeCarriers();
  return prepared;
}

TransferReport TransferClip(const Clip& clip, const ClipBody& from,
                            const PreparedObject& from_object, const ClipBody& to,
                            const PreparedObject& to_object, const SurfaceMap& map,
                            const TransferOptions& options, const StagedProgress& progress,
                            const OntoBody* onto) {
  if (from.model->Kind() != to.model->Kind() ||
      from.model->NumVertices() != to.model->NumVertices()) {
    throw Error("body", "is not the clip's body model",
                "Convert the clip to this model first ('holdfast convert')");
  }
  TransferReport report;
  if (onto != nullptr) report.body = onto->report;
  const TransferHands hands(from, to);
  const Clip prepared = PrepareTransfer(clip, from, from_object, to, to_object, map, hands, options,
                                        report, onto != nullptr ? &onto->clip : nullptr);
  if (progress && !progress("carry", 1, 1)) return report;
  CarryOptions carry = options.carry;
  carry.grasp = GraspSource::kClips;
  carry.hands = GraspHands::kAuto;
  report.carried = CarryObject(prepared, to, to_object, carry, progress);
  const bool comes_or_goes = std::ranges::any_of(report.holds, [&](const TransferredHold& hold) {
    return hold.begin > 0 || hold.end < prepared.NumFrames();
  });
  if (report.carried.status == CarryStatus::kCarried && comes_or_goes) {
    ClearWays(prepared, hands, to_object, options, report);
  }
  return report;
}

OptionTable OptionsOf(TransferOptions& options) {
  OptionTable table;
  table.Group("General");
  table.Choice("keep", options.keeps,
               {{"auto", TransferKeeps::kAuto},
                {"wrists", TransferKeeps::kWrists},
                {"object", TransferKeeps::kObject}},
               "Trajectory to keep: wrists (the object follows), object (the arms follow), or "
               "auto: wrists if the same hand of the same body holds throughout, else object");
  table.Flag("search", options.search,
             "Search for a new grasp near the contacts if the hand can't keep them");
  table.Flag("keep_motion", options.carry.keep_motion,
             "Do not adjust the arms; only report collisions with the body");
  table.Number("object_vertices", "", options.object_vertices, {4, 100'000},
               "Vertices that objects are simplified to");
  return table;
}

nlohmann::json MapJson(const SurfaceMapReport& map) {
  return {{"method", std::string(map.method)},
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
          {"height_ratio", report.body.height_ratio},
          {"hand_ratio", report.body.fingers_ratio},
          {"ankle_missed_mm", 1e3 * report.body.ankle_missed_m},
          {"pelvis_sink_mm", 1e3 * report.body.sink_m},
          {"stands_off_mm", 1e3 * report.arms.step_m},
          {"arm_shortfall_mm", 1e3 * report.arms.shortfall_m},
          {"wrist_moved_mean_mm", 1e3 * report.arms.wrist_moved_mean_m},
          {"wrist_moved_max_mm", 1e3 * report.arms.wrist_moved_max_m}};
}

}  // namespace holdfast
