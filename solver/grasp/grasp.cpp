// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "solver/grasp/grasp_refinement.h"
#include "solver/grasp/grasp_stages.h"

namespace holdfast {
namespace {

using Clock = std::chrono::steady_clock;

double MillisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// The placements most worth closing, but not all from one place: each further one of a style from
// the same place counts less.
std::vector<Placement> MostPromising(const GraspScene& scene,
                                     std::span<const std::vector<Placement>> places, int count) {
  const GraspOptions& options = scene.options;
  std::vector<std::pair<double, const Placement*>> queue;
  for (const std::vector<Placement>& placements : places) {
    for (const GraspStyle style :
         {GraspStyle::kPower, GraspStyle::kPrecision, GraspStyle::kHandle}) {
      if (options.style && *options.style != style) continue;
      std::vector<std::pair<double, const Placement*>> of_style;
      for (const Placement& placement : placements) {
        if (placement.style != style) continue;
        const double upright = Uprightness(scene, placement.wrist_from_object);
        const Eigen::Matrix3d turned = placement.wrist_from_object.linear().transpose();
        of_style.emplace_back(
            placement.prior *
                std::exp(UprightScore(scene, style, upright) +
                         scene.use.DirectionScore(turned * scene.anatomy.axes.Across(),
                                                  turned * scene.anatomy.axes.Forward()) -
                         options.obstacle_weight * Blocked(scene, placement.wrist_from_object)),
            &placement);
      }
      std::stable_sort(of_style.begin(), of_style.end(),
                       [](const auto& a, const auto& b) { return a.first > b.first; });
      double discount = 1.0;
      for (const auto& [prior, placement] : of_style) {
        queue.emplace_back(prior * discount, placement);
        discount *= 0.9;
      }
    }
  }
  std::stable_sort(queue.begin(), queue.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Placement> best;
  for (const auto& [prior, placement] : queue) {
    if (static_cast<int>(best.size()) == count) break;
    best.push_back(*placement);
  }
  return best;
}

void SortBestFirst(std::vector<GraspReport::Candidate>& candidates) {
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    if (a.refused.empty() != b.refused.empty()) return a.refused.empty();
    return a.grasp.score > b.grasp.score;
  });
}

// Places for hands, the most promising first of each kind: `around` of them around the object, the
// rest by its handles.
struct PlacementQueue {
  std::vector<Placement> placements;
  std::size_t around = 0;
};

// One call of CloseHand: its stages in their order, and what they share.
class GraspSearch : GraspStages {
 public:
  GraspSearch(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
              const GraspOptions& options, const GraspProgress& progress, GraspReport& report)
      : GraspStages(hand, object, distance, options, progress),
        out_(report),
        solid_(WhyNotSolid(object).empty()) {
    open_.fingers = anatomy_.axes.PoseOf(OpenHand(anatomy_.axes));
  }

  Grasp Run(const SignedDistance& surface);

 private:
  bool PlaceHands(PlacementQueue& queue);
  bool ClosePlaced(const PlacementQueue& queue, std::vector<GraspAttempt>& attempts);
  void KeepBest(std::size_t around, std::vector<GraspAttempt>& attempts) const;
  bool Refine(const std::vector<GraspAttempt>& attempts,
              std::vector<GraspReport::Candidate>& refined);
  double LostBySlipping(const Grasp& grasp, HandEvaluation& evaluation) const;
  Grasp ReportBest(std::vector<GraspReport::Candidate> refined, const SignedDistance& surface);
  Grasp Stopped() {
    out_.status = GraspStatus::kStopped;
    return open_;
  }

  GraspReport& out_;
  const bool solid_;
  Grasp open_;
};

bool GraspSearch::PlaceHands(PlacementQueue& queue) {
  std::vector<std::vector<Placement>> placed(out_.oppositions + out_.handles);
  if (!RunStage(0.0, 0.2, out_.oppositions + out_.handles,
                [&](int i) { placed[i] = PlaceAt(i); })) {
    return false;
  }
  for (const std::vector<Placement>& placements : placed) {
    out_.placements += static_cast<int>(placements.size());
  }
  queue.placements = MostPromising(scene_, {placed.data(), oppositions_.size()}, options_.closings);
  queue.around = queue.placements.size();
  const std::vector<Placement> by_handle = MostPromising(
      scene_, {placed.data() + out_.oppositions, scene_.handles.size()}, options_.closings / 2);
  queue.placements.insert(queue.placements.end(), by_handle.begin(), by_handle.end());
  return true;
}

bool GraspSearch::ClosePlaced(const PlacementQueue& queue, std::vector<GraspAttempt>& attempts) {
  out_.closings = static_cast<int>(queue.placements.size());
  attempts.resize(queue.placements.size());
  return RunStage(0.2, 0.4, out_.closings, [&](int i) {
    HandEvaluation evaluation = at_wrist_;
    attempts[i] = Close(queue.placements[i], evaluation).attempt;
    attempts[i].rank = Assess(scene_, evaluation, attempts[i], false).score;
  });
}

// The best of both kinds are refined: what is through a handle is not compared with what is not
// before it is refined. The first `around` attempts are not.
void GraspSearch::KeepBest(std::size_t around, std::vector<GraspAttempt>& attempts) const {
  const auto better = [](const GraspAttempt& a, const GraspAttempt& b) { return a.rank > b.rank; };
  std::stable_sort(attempts.begin(), attempts.begin() + around, better);
  std::stable_sort(attempts.begin() + around, attempts.end(), better);
  const auto keep = [&](std::size_t begin, std::size_t end, int count) {
    const std::size_t kept = std::min<std::size_t>(end - begin, count);
    attempts.erase(attempts.begin() + begin + kept, attempts.begin() + end);
    return kept;
  };
  const std::size_t kept_around = keep(0, around, options_.refinements);
  keep(kept_around, attempts.size(), std::max(1, options_.refinements / 2));
}

// All are refined roughly and those that promise most to the end, a few at a time: nothing that is
// measured then adds to a score, so that what is far behind the best clean one stays there.
bool GraspSearch::Refine(const std::vector<GraspAttempt>& attempts,
                         std::vector<GraspReport::Candidate>& refined) {
  constexpr int kAtOnce = 4;
  constexpr double kGain = 0.3;  // of score, by the rest of the refinement
  RefinementOptions rough, rest;
  rough.rounds = rest.rounds = 1;
  rough.iterations = 10;
  std::vector<GraspAttempt> begun = attempts;
  const int count = static_cast<int>(attempts.size());
  if (!RunStage(0.6, 0.2, count, [&](int i) {
        HandEvaluation evaluation = at_wrist_;
        RefineGrasp(anatomy_, evaluation, distance_, rough, begun[i].angles,
                    begun[i].wrist_from_object);
        begun[i].rank = Assess(scene_, evaluation, begun[i], false).score;
      })) {
    return false;
  }
  std::stable_sort(begun.begin(), begun.end(),
                   [](const GraspAttempt& a, const GraspAttempt& b) { return a.rank > b.rank; });
  double best = -std::numeric_limits<double>::infinity();
  for (int first = 0; first < count; first += kAtOnce) {
    if (options_.best_only && best > begun[first].rank + kGain) break;
    const int some = std::min(kAtOnce, count - first);
    refined.resize(first + some);
    if (!RunStage(0.8 + 0.2 * first / count, 0.2 * some / count, some, [&](int i) {
          HandEvaluation evaluation = at_wrist_;
          GraspAttempt attempt = begun[first + i];
          RefineGrasp(anatomy_, evaluation, distance_, rest, attempt.angles,
                      attempt.wrist_from_object);
          GraspReport::Candidate& candidate = refined[first + i];
          candidate.grasp = Assess(scene_, evaluation, attempt, true);
          candidate.refused = WhyRefused(scene_, candidate.grasp);
          if (solid_ && candidate.refused.empty()) {
            candidate.grasp.score -= LostBySlipping(candidate.grasp, evaluation);
          }
        })) {
      return false;
    }
    for (int i = first; i < first + some; ++i) {
      if (refined[i].refused.empty()) best = std::max(best, refined[i].grasp.score);
    }
  }
  out_.refinements = static_cast<int>(refined.size());
  return true;
}

// What does not hold the object's weight in every direction with the friction assumed is not as
// good as what does, nor what has to squeeze hard for it as what does so lightly, nor what would
// let go if the weight pulled a little farther off.
double GraspSearch::LostBySlipping(const Grasp& grasp, HandEvaluation& evaluation) const {
  constexpr double kSlips = 1.5, kSqueezes = 0.3, kOffCenter = 0.1, kOffset = 0.1;
  const std::vector<GraspContact> contacts =
      Contacts(evaluation, grasp.fingers, grasp.wrist_from_object);
  double lost = 0.0;
  CertificateOptions firm;
  firm.most_squeeze = 12.0;
  for (int k = 0; k < 6; ++k) {
    const Eigen::Vector3d offset =
        (k % 2 == 0 ? 1.0 : -1.0) * kOffset * scene_.size * Eigen::Vector3d::Unit(k / 2);
    if (!HoldsGravity(contacts, scene_.centroid + offset, 0.5 * scene_.size, options_.friction,
                      firm)) {
      lost += kOffCenter;
    }
  }
  for (const double weights : {6.0, 12.0, CertificateOptions{}.most_squeeze}) {
    CertificateOptions options;
    options.most_squeeze = weights;
    if (HoldsGravity(contacts, scene_.centroid, 0.5 * scene_.size, options_.friction, options)) {
      return lost;
    }
    lost += kSqueezes;
  }
  return kSlips;
}

Grasp GraspSearch::ReportBest(std::vector<GraspReport::Candidate> refined,
                              const SignedDistance& surface) {
  SortBestFirst(refined);
  HandEvaluation evaluation = at_wrist_;
  if (solid_) {
    Grasp& first = refined.front().grasp;
    first.certificate = Certify(Contacts(evaluation, first.fingers, first.wrist_from_object));
  }
  Grasp best = refined.front().grasp;
  out_.status = refined.front().refused.empty() ? GraspStatus::kFound : GraspStatus::kNoCleanGrasp;
  out_.candidates = std::move(refined);
  const Eigen::Matrix3Xd in_object =
      best.wrist_from_object.inverse() * evaluation.At(best.fingers.data(), false).Vertices();
  best.metrics = MeasureContact(TriangleMesh{in_object, hand_.Surface().Faces()}, surface);
  out_.candidates.front().grasp.metrics = best.metrics;
  return best;
}

Grasp GraspSearch::Run(const SignedDistance& surface) {
  Clock::time_point stage = Clock::now();
  FindPlaces(OppositionOptions{}.samples, options_.oppositions, options_.seed, true);
  out_.use = scene_.use.kind;
  out_.oppositions = static_cast<int>(oppositions_.size());
  out_.handles = static_cast<int>(scene_.handles.size());
  if (out_.oppositions + out_.handles == 0) {
    if (options_.place) out_.status = GraspStatus::kNothingAtPlace;
    if (options_.style == GraspStyle::kHandle) out_.status = GraspStatus::kNoHandle;
    return open_;
  }
  PlacementQueue queue;
  if (!PlaceHands(queue)) return Stopped();
  out_.search_ms = MillisecondsSince(stage);
  if (queue.placements.empty()) {
    out_.status = GraspStatus::kNoRoom;
    return open_;
  }

  stage = Clock::now();
  std::vector<GraspAttempt> attempts;
  if (!ClosePlaced(queue, attempts)) return Stopped();
  KeepBest(queue.around, attempts);
  out_.closing_ms = MillisecondsSince(stage);

  stage = Clock::now();
  std::vector<GraspReport::Candidate> refined;
  if (!Refine(attempts, refined)) return Stopped();
  const Grasp best = ReportBest(std::move(refined), surface);
  out_.refinement_ms = MillisecondsSince(stage);
  return best;
}

}  // namespace

std::string_view Describe(GraspStatus status) {
  switch (status) {
    case GraspStatus::kFound:
      return "found";
    case GraspStatus::kNothingToGrasp:
      return "no two opposed places are within a hand's span";
    case GraspStatus::kNothingAtPlace:
      return "at the place asked for, no two opposed places are within a hand's span";
    case GraspStatus::kNoHandle:
      return "there is no handle that a finger fits through";
    case GraspStatus::kNoRoom:
      return "there is no room for a hand at any graspable place";
    case GraspStatus::kNoCleanGrasp:
      return "no grasp is clean and firm";
    case GraspStatus::kFewer:
      return "fewer distinct grasps than asked for";
    case GraspStatus::kStopped:
      return "stopped before the search was done";
  }
  return "";
}

std::string_view StyleName(GraspStyle style) {
  switch (style) {
    case GraspStyle::kPower:
      return "power";
    case GraspStyle::kPrecision:
      return "precision";
    case GraspStyle::kHandle:
      return "handle";
  }
  return "";
}

std::optional<GraspStyle> StyleByName(std::string_view name) {
  for (const GraspStyle style : {GraspStyle::kPower, GraspStyle::kPrecision, GraspStyle::kHandle}) {
    if (StyleName(style) == name) return style;
  }
  return std::nullopt;
}

Eigen::Isometry3d ObjectInWorld(const Grasp& grasp, const Eigen::Matrix3d& wrist_rotation,
                                const Eigen::Vector3d& wrist_position) {
  return RigidTransform(wrist_rotation, wrist_position) * grasp.wrist_from_object;
}

Grasp CloseHand(const HandModel& hand, const TriangleMesh& object, const SignedDistance& surface,
                const DistanceGrid& distance, const GraspOptions& options, GraspReport* report,
                const GraspProgress& progress) {
  GraspReport unused;
  GraspReport& out = report ? *report : unused;
  out = {};
  return GraspSearch(hand, object, distance, options, progress, out).Run(surface);
}

}  // namespace holdfast
