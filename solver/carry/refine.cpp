// SPDX-License-Identifier: MIT
#include "solver/carry/refine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/carry/follow.h"
#include "solver/handover/holds.h"

namespace holdfast {
namespace {

std::vector<std::uint8_t> WhoHoldsIn(const Clip& clip, const HandModel& right,
                                     const HandModel& left, const PreparedObject& object, bool ball,
                                     const RefineOptions& options) {
  const auto always = [&](std::uint8_t bits) {
    return std::vector<std::uint8_t>(static_cast<std::size_t>(clip.NumFrames()), bits);
  };
  switch (options.hands) {
    case RefineHands::kRight:
      return always(kHoldsRight);
    case RefineHands::kLeft:
      return always(kHoldsLeft);
    case RefineHands::kBoth:
      return always(kHoldsRight | kHoldsLeft);
    case RefineHands::kOfClip:
      if (clip.holding_hand.empty()) {
        throw Error("the clip", "has no holding_hand", "Leave out --hand clip");
      }
      return clip.holding_hand;
    case RefineHands::kFound:
      break;
  }
  if (ball) {
    const std::array<const HandModel*, 2> hands = {&right, &left};
    return FindFollows(clip, hands, object, options.threads);
  }
  return FindHolds(clip, right, left, *object.fit.distance, options.threads).hands;
}

std::vector<const HandModel*> ThoseWhoHold(const HandModel& right, const HandModel& left,
                                           const std::vector<std::uint8_t>& holding,
                                           const BodyModel& body) {
  std::vector<const HandModel*> hands;
  for (const HandModel* hand : {&right, &left}) {
    const std::uint8_t bit = HoldingBit(hand->HandSide());
    if (std::ranges::none_of(holding, [&](std::uint8_t bits) { return (bits & bit) != 0; })) {
      continue;
    }
    RequireHands(body, bit);
    hands.push_back(hand);
  }
  return hands;
}

CarriedQuality QualityOf(const Clip& clip, std::span<const HandModel* const> hands,
                         std::span<const std::uint8_t> holding, const PreparedObject& object,
                         const ContactProtocol& protocol,
                         const std::function<bool(int, int)>& progress) {
  const std::vector<HandObjectScore> scores =
      MeasureHands(clip, hands, holding, object.solid, protocol, progress);
  CarriedQuality quality;
  quality.contact = ScoreContact(scores);
  quality.jitter = MeanJitter(scores);
  for (const HandObjectScore& score : scores) {
    for (std::size_t t = 0; t < score.frames.size(); ++t) {
      if (!score.Holds(t)) continue;
      ++quality.hand_frames;
      quality.hand_frames_in_contact += score.frames[t].hand.in_contact;
    }
  }
  quality.tips = CountFingertips(clip, hands, object, holding);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    quality.finger_jump_frames += FingerJumpFrames(clip, side);
  }
  return quality;
}

// Allowed penetration of a touching hand if the clip's hand touches nothing.
constexpr double kTouch_mm = 1.0;
constexpr double kBlend_s = 0.15;  // from a kept frame to a refined one

Eigen::Vector3d Between(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double share) {
  if (share >= 1.0 || from == to) return to;
  const Eigen::Matrix3d turn = ExpSO3(from);
  return LogSO3(turn * ExpSO3(share * LogSO3(turn.transpose() * ExpSO3(to))));
}

// Returns `refined` with the clip's own poses in the `kept` frames, blended around them.
Clip KeepFrames(const Clip& clip, const Clip& refined, const std::vector<char>& kept) {
  const int frames = clip.NumFrames();
  const double reach = std::max(1.0, std::round(kBlend_s * clip.frame_rate)) + 1.0;
  std::vector<double> away(static_cast<std::size_t>(frames), reach);  // from the nearest kept frame
  for (int t = 0; t < frames; ++t) {
    away[t] = kept[t] != 0 ? 0.0 : t > 0 ? std::min(reach, away[t - 1] + 1.0) : reach;
  }
  for (int t = frames - 2; t >= 0; --t) away[t] = std::min(away[t], away[t + 1] + 1.0);
  Clip result = refined;
  for (int t = 0; t < frames; ++t) {
    const double near = 1.0 - away[t] / reach;
    const double share = near * near * (3.0 - 2.0 * near);
    if (share <= 0.0) continue;
    result.trans.col(t) += share * (clip.trans.col(t) - refined.trans.col(t));
    for (Eigen::Index joint = 0; joint < result.pose[t].cols(); ++joint) {
      result.pose[t].col(joint) =
          Between(refined.pose[t].col(joint), clip.pose[t].col(joint), share);
    }
    Eigen::Isometry3d object = Eigen::Isometry3d::Identity();
    object.translation() = refined.object->trans.col(t) +
                           share * (clip.object->trans.col(t) - refined.object->trans.col(t));
    object.linear() =
        ExpSO3(Between(refined.object->orient.col(t), clip.object->orient.col(t), share));
    result.object->SetPose(t, object);
  }
  return result;
}

std::vector<FrameRange> RangesOf(const std::vector<char>& kept) {
  std::vector<FrameRange> ranges;
  for (int t = 0; t < static_cast<int>(kept.size()); ++t) {
    if (kept[t] == 0) continue;
    if (t == 0 || kept[t - 1] == 0) ranges.push_back({t, t});
    ranges.back().end = t + 1;
  }
  return ranges;
}

// Marks frames with penetration above `most_mm`, and `around` frames on either side. Returns
// whether there are any.
bool MarkDeeper(const ContactScore& score, double most_mm, int around, std::vector<char>& kept) {
  const auto frames = static_cast<int>(score.frames.size());
  bool any = false;
  for (int t = 0; t < frames; ++t) {
    if (score.frames[t].penetration_mm <= most_mm) continue;
    any = true;
    std::fill(kept.begin() + std::max(0, t - around),
              kept.begin() + std::min(frames, t + around + 1), char{1});
  }
  return any;
}

// Keeps frames of the clip until none exceeds the clip's maximum penetration, or kTouch_mm.
void KeepShallow(const Clip& clip, const std::function<CarriedQuality(const Clip&)>& measure,
                 const std::function<bool()>& stopped, RefineReport& report) {
  constexpr double kSame_mm = 1e-9;
  constexpr int kRounds = 4;
  const double most_mm = std::max(report.before.contact.penetration_max_mm, kTouch_mm) + kSame_mm;
  const int around = static_cast<int>(std::lround(kBlend_s * clip.frame_rate));
  const Clip refined = report.result.clip;
  std::vector<char> kept(refined.pose.size(), 0);
  for (int round = 0; MarkDeeper(report.after.contact, most_mm, round * around, kept); ++round) {
    if (round == kRounds) std::ranges::fill(kept, char{1});
    report.result.clip = KeepFrames(clip, refined, kept);
    report.after = measure(report.result.clip);
    if (stopped() || round == kRounds) break;
  }
  report.kept = RangesOf(kept);
}

}  // namespace

DataDistance DistanceToData(const Clip& data, const Clip& refined) {
  const std::vector<Eigen::Isometry3d> from = ObjectPoses(data), to = ObjectPoses(refined);
  DataDistance distance;
  double shift = 0.0, turn = 0.0;
  for (std::size_t t = 0; t < from.size(); ++t) {
    const double mm = 1e3 * (to[t].translation() - from[t].translation()).norm();
    const double degrees =
        Eigen::AngleAxisd(from[t].linear().transpose() * to[t].linear()).angle() / kDegree;
    distance.mm.push_back(mm);
    distance.degrees.push_back(degrees);
    shift += mm * mm;
    turn += degrees * degrees;
  }
  const auto count = static_cast<double>(from.size());
  distance.rms_mm = std::sqrt(shift / count);
  distance.rms_degrees = std::sqrt(turn / count);
  return distance;
}

RefineReport RefineCarried(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                           const RefineOptions& asked, const StagedProgress& progress) {
  if (!clip.object) {
    throw Error("the clip", "has no object trajectory to refine",
                "Make one with 'holdfast fit', or give a clip with object_trans and object_orient");
  }
  RefineOptions options = asked;
  options.fit.threads = options.protocol.threads = options.threads;
  const HandModel right(body.model, body.betas, Side::kRight);
  const HandModel left(body.model, body.betas, Side::kLeft);
  RefineReport report;
  Clip repaired = clip;
  for (const HandModel* hand : {&right, &left}) {
    if (hand->NumVertices() == 0) continue;
    report.fingers.push_back(RepairFingers(HandAxes(*hand), repaired));
  }
  report.ball = IsUnturnedBall(clip, object.object.mesh);
  const std::vector<std::uint8_t> holding =
      WhoHoldsIn(repaired, right, left, object, report.ball, options);
  std::vector<const HandModel*> hands = ThoseWhoHold(right, left, holding, *body.model);
  for (const HandModel* hand : {&right, &left}) {  // or touches, if none holds
    if (options.hands != RefineHands::kFound ||
        (!report.ball && std::ranges::any_of(holding, std::identity{}))) {
      break;
    }
    if (std::ranges::find(hands, hand) != hands.end()) continue;
    const std::vector<double> gaps = SkinGaps(repaired, *hand, object, options.threads);
    if (std::ranges::any_of(gaps, [](double gap) { return gap < 0.0; })) hands.push_back(hand);
  }
  if (hands.empty()) {
    throw Error("the clip", "has an object that no hand holds in any frame",
                "Give the holding hand with --hand");
  }

  bool stopped = false;
  const auto telling = [&](const char* stage) {
    return [&, stage](int done, int total) {
      if (progress && !progress(stage, done, total)) stopped = true;
      return !stopped;
    };
  };
  const auto solve = [&](const FitOptions& fit) {
    RefineResult result =
        report.ball ? RefineBall(repaired, hands, object, holding, fit, telling("refine"))
                    : RefineClip(repaired, hands, object.fit, holding, fit, telling("refine"));
    if (!stopped && !result.report.failed) {
      result.clip.object->name = object.object.name;
      result.clip.object->mesh = "object.ply";
    }
    return result;
  };
  const auto measure = [&](const Clip& measured) {
    return QualityOf(measured, hands, report.result.clip.holding_hand, object, options.protocol,
                     telling("metrics"));
  };
  report.result = solve(options.fit);
  if (stopped) return report;
  if (report.result.report.failed) {
    report.status = RefineStatus::kNotFinite;
    return report;
  }
  report.before = measure(clip);
  if (!stopped) report.after = measure(report.result.clip);
  constexpr double kDeeper_mm = 1e-3;
  constexpr double kLost = 0.1;  // of the held frames
  const double most_mm = std::max(report.before.contact.penetration_max_mm, kTouch_mm) + kDeeper_mm;
  const auto rank = [&](const ContactScore& after) {  // lower is better
    return std::tuple(after.penetration_max_mm > most_mm, after.deep_frames,
                      after.penetration_max_mm);
  };
  if (!stopped && rank(report.after.contact) > std::tuple(false, 0, kDeep_mm)) {
    constexpr double kHarder = 10.0;
    FitOptions harder = options.fit;
    harder.lambda_penetration *= kHarder;
    harder.lambda_object_in_hand *= kHarder;
    RefineResult again = solve(harder);
    if (!stopped && !again.report.failed) {
      std::swap(report.result, again);
      CarriedQuality after = measure(report.result.clip);
      if (rank(after.contact) < rank(report.after.contact) &&
          after.contact.contact_frames_ratio.value_or(0.0) >=
              report.after.contact.contact_frames_ratio.value_or(0.0) - kLost) {
        report.before = measure(clip);  // the held frames may have changed
        report.after = std::move(after);
      } else {
        std::swap(report.result, again);
      }
    }
  }
  if (!stopped)
    KeepShallow(
        clip, measure, [&] { return stopped; }, report);
  if (stopped) return report;
  if (!body.model->LoneHand()) {
    ClearanceOptions clearance;
    clearance.keep_motion = options.keep_motion;
    clearance.threads = options.threads;
    report.clearance = KeepOutOfBody(BodySurface(body.model, body.betas), object.object.mesh,
                                     clearance, report.result.clip);
  }
  report.distance = DistanceToData(clip, report.result.clip);
  const bool touched = report.after.contact.contact_frames_ratio.value_or(report.ball) > 0.0;
  report.contact_kept =
      report.ball || report.after.contact.contact_frames_ratio.value_or(0.0) >=
                         report.before.contact.contact_frames_ratio.value_or(0.0) - kLost;
  report.sound = report.contact_kept &&
                 (options.keep_motion || report.clearance.worst_m <= ClearanceOptions{}.max_left_m);
  report.status = touched ? RefineStatus::kRefined : RefineStatus::kNoContact;
  return report;
}

OptionTable OptionsOf(RefineOptions& options) {
  OptionTable table;
  table.Choice("hand", options.hands,
               {{"auto", RefineHands::kFound},
                {"clip", RefineHands::kOfClip},
                {"right", RefineHands::kRight},
                {"left", RefineHands::kLeft},
                {"both", RefineHands::kBoth}},
               "Hand that holds the object; auto: detected in each frame; clip: as stored in the "
               "clip (holding_hand)");
  table.Number("object_vertices", "", options.object_vertices, {4, 100'000},
               "Vertices that the object is simplified to");
  table.Flag("keep_motion", options.keep_motion,
             "Do not move arms and object out of the person's own body; only report collisions");
  AddWeightOptions(table, options.fit, [](const EnergyTermInfo& info) {
    constexpr EnergyTerm kTerms[] = {EnergyTerm::kObject,       EnergyTerm::kFingers,
                                     EnergyTerm::kAcceleration, EnergyTerm::kSupport,
                                     EnergyTerm::kPenetration,  EnergyTerm::kObjectInHand};
    return std::ranges::find(kTerms, info.term) != std::end(kTerms);
  });
  return table;
}

void RequireRefined(const RefineReport& report, const std::string& clip,
                    const std::string& object) {
  if (report.status == RefineStatus::kNotFinite) {
    throw FitFailure(clip + ": the solve diverged (non-finite values)");
  }
  if (report.status == RefineStatus::kNoContact) {
    throw FitFailure(
        fmt::format("{}: no holding hand touches {} in any frame, so nothing is written. Give the "
                    "holding hand with --hand, or make a new grasp with fit --regrasp",
                    clip, object));
  }
}

}  // namespace holdfast
