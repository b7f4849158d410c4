// SPDX-License-Identifier: MIT
#include "solver/carry/refine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

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
    return FindFollows(clip, hands, object, {}, options.threads);
  }
  HoldOptions search;
  search.threads = options.threads;
  return FindHolds(clip, right, left, *object.fit.distance, search).hands;
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
  for (const HandModel* hand : {&right, &left}) {  // or touch, where nobody holds
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
                "Say which hand does with --hand");
  }

  bool stopped = false;
  const auto telling = [&](const char* stage) {
    return [&, stage](int done, int total) {
      if (progress && !progress(stage, done, total)) stopped = true;
      return !stopped;
    };
  };
  report.result =
      report.ball
          ? RefineBall(repaired, hands, object, holding, options.fit, telling("refine"))
          : RefineClip(repaired, hands, object.fit, holding, options.fit, telling("refine"));
  if (stopped) return report;
  if (report.result.report.failed) {
    report.status = RefineStatus::kNotFinite;
    return report;
  }
  Clip& refined = report.result.clip;
  refined.object->name = object.object.name;
  refined.object->mesh = "object.ply";
  for (const auto& [measured, quality] :
       {std::pair<const Clip*, CarriedQuality*>(&clip, &report.before),
        std::pair<const Clip*, CarriedQuality*>(&refined, &report.after)}) {
    *quality = QualityOf(*measured, hands, refined.holding_hand, object, options.protocol,
                         telling("metrics"));
    if (stopped) return report;
  }
  report.distance = DistanceToData(clip, refined);
  const bool touched = report.after.contact.contact_frames_ratio.value_or(report.ball) > 0.0;
  report.status = touched ? RefineStatus::kRefined : RefineStatus::kNoContact;
  return report;
}

}  // namespace holdfast
