// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <utility>

#include "solver/grasp/grasp_stages.h"

namespace holdfast {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array<std::string_view, 3> kStyleNames = {"power", "precision", "handle"};

double MillisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Rank of a placement, by its prior, the object's up, the use and the obstacles.
double Promise(const GraspScene& scene, const Placement& placement) {
  const Eigen::Matrix3d turned = placement.wrist_from_object.linear().transpose();
  return placement.prior *
         std::exp(
             UprightScore(scene, placement.style, Uprightness(scene, placement.wrist_from_object)) +
             scene.use.DirectionScore(turned * scene.anatomy.axes.Across(),
                                      turned * scene.anatomy.axes.Forward(),
                                      turned * scene.anatomy.axes.PalmNormal()) -
             scene.options.obstacle_weight * Blocked(scene, placement.wrist_from_object));
}

// Selects the most promising placements to close, but not all from one place: each further one of
// the same style and place counts less.
std::vector<Placement> MostPromising(std::span<const std::vector<Placement>> places, int count) {
  std::vector<std::pair<double, const Placement*>> queue;
  for (const std::vector<Placement>& placements : places) {
    for (const GraspStyle style :
         {GraspStyle::kPower, GraspStyle::kPrecision, GraspStyle::kHandle}) {
      std::vector<const Placement*> of_style;
      for (const Placement& placement : placements) {
        if (placement.style == style) of_style.push_back(&placement);
      }
      std::ranges::stable_sort(of_style, std::greater(), &Placement::prior);
      double discount = 1.0;
      for (const Placement* placement : of_style) {
        queue.emplace_back(placement->prior * discount, placement);
        discount *= 0.9;
      }
    }
  }
  std::ranges::stable_sort(queue, std::greater(), [](const auto& one) { return one.first; });
  std::vector<Placement> best;
  for (const auto& [prior, placement] : queue) {
    if (static_cast<int>(best.size()) == count) break;
    best.push_back(*placement);
  }
  return best;
}

void SortBestFirst(std::vector<GraspReport::Candidate>& candidates) {
  std::ranges::stable_sort(candidates, [](const auto& a, const auto& b) {
    if (a.refused.empty() != b.refused.empty()) return a.refused.empty();
    return a.grasp.score > b.grasp.score;
  });
}

// One call of CloseHand: its stages in order, and their shared data.
class GraspSearch : GraspStages {
 public:
  GraspSearch(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
              const GraspOptions& options, const GraspProgress& progress, GraspReport& report)
      : GraspStages(hand, object, distance, options, progress),
        out_(report),
        solid_(WhyNotSolid(object).empty()) {
    open_.fingers = anatomy_.axes.PoseOf(OpenHand(anatomy_.axes));
  }

  Grasp Run(const SignedDistance& surface) {
    const Clock::time_point start = Clock::now();
    FindPlaces(OppositionOptions{}.samples, options_.oppositions, options_.seed, true);
    out_.search_ms = MillisecondsSince(start);
    out_.use = scene_.use.kind;
    out_.oppositions = static_cast<int>(oppositions_.size());
    out_.handles = static_cast<int>(scene_.handles.size());
    if (out_.oppositions + out_.handles == 0) {
      if (options_.place) out_.status = GraspStatus::kNothingAtPlace;
      if (options_.style == GraspStyle::kHandle) out_.status = GraspStatus::kNoHandle;
      return open_;
    }
    // Grasps through a handle are compared with the others only after refinement.
    constexpr double kByHandle = 0.4;  // fraction of the progress
    const double by_handle = out_.handles > 0 ? kByHandle : 0.0;
    std::vector<GraspReport::Candidate> refined;
    if (!Search({out_.oppositions, out_.handles, options_.closings / 2,
                 std::max(1, options_.refinements / 2), 0.0, by_handle},
                refined)) {
      return Stopped();
    }
    if (!HandleIsEnough(refined) && !Search({0, out_.oppositions, options_.closings,
                                             options_.refinements, by_handle, 1.0 - by_handle},
                                            refined)) {
      return Stopped();
    }
    if (refined.empty()) {
      out_.status = GraspStatus::kNoRoom;
      return open_;
    }
    return ReportBest(std::move(refined), surface);
  }

 private:
  // Antipodal places or handles: index of the first place, their number, how many hands are closed
  // and refined there, the progress before this part and this part's fraction of it.
  struct Part {
    int first, count, closings, refinements;
    double before, share;
  };
  bool Search(const Part& part, std::vector<GraspReport::Candidate>& refined) {
    std::vector<Placement> queue;
    std::vector<GraspAttempt> attempts;
    return PlaceHands(part, queue) && ClosePlaced(part, queue, attempts) &&
           Refine(part, std::move(attempts), refined);
  }

  bool PlaceHands(const Part& part, std::vector<Placement>& queue) {
    const Clock::time_point start = Clock::now();
    std::vector<std::vector<Placement>> placed(part.count);
    if (!RunStage(part.before, 0.2 * part.share, part.count, [&](int i) {
          placed[i] = PlaceAt(part.first + i);
          if (options_.style) {
            std::erase_if(placed[i],
                          [&](const Placement& p) { return p.style != *options_.style; });
          }
          for (Placement& placement : placed[i]) placement.prior = Promise(scene_, placement);
        })) {
      return false;
    }
    for (const std::vector<Placement>& placements : placed) {
      out_.placements += static_cast<int>(placements.size());
    }
    queue = MostPromising(placed, part.closings);
    out_.search_ms += MillisecondsSince(start);
    return true;
  }

  // Keeps the best closed hands.
  bool ClosePlaced(const Part& part, const std::vector<Placement>& queue,
                   std::vector<GraspAttempt>& attempts) {
    const Clock::time_point start = Clock::now();
    const auto count = static_cast<int>(queue.size());
    out_.closings += count;
    attempts.resize(queue.size());
    if (!RunStage(part.before + 0.2 * part.share, 0.4 * part.share, count, [&](int i) {
          HandEvaluation evaluation = at_wrist_;
          attempts[i] = Close(queue[i], evaluation).first;
          attempts[i].rank = Assess(scene_, evaluation, attempts[i], false).score;
        })) {
      return false;
    }
    std::ranges::stable_sort(attempts, std::greater(), &GraspAttempt::rank);
    attempts.resize(std::min<std::size_t>(attempts.size(), part.refinements));
    out_.closing_ms += MillisecondsSince(start);
    return true;
  }

  // Refines all attempts roughly, then the most promising ones fully, a few at a time. The thorough
  // assessment only lowers scores, so an attempt far behind the best clean one cannot catch up.
  bool Refine(const Part& part, std::vector<GraspAttempt> begun,
              std::vector<GraspReport::Candidate>& refined) {
    constexpr int kAtOnce = 4;
    constexpr double kGain = 0.3;  // maximum score gain by the remaining refinement
    const Clock::time_point start = Clock::now();
    RefinementOptions rough, rest;
    rough.rounds = rest.rounds = 1;
    rough.iterations = 10;
    const auto count = static_cast<int>(begun.size());
    if (!RunStage(part.before + 0.6 * part.share, 0.2 * part.share, count, [&](int i) {
          HandEvaluation evaluation = at_wrist_;
          RefineGrasp(anatomy_, evaluation, distance_, rough, begun[i].angles,
                      begun[i].wrist_from_object);
          begun[i].rank = Assess(scene_, evaluation, begun[i], false).score;
        })) {
      return false;
    }
    std::ranges::stable_sort(begun, std::greater(), &GraspAttempt::rank);
    double best = -std::numeric_limits<double>::infinity();
    for (const GraspReport::Candidate& before : refined) {
      if (before.refused.empty()) best = std::max(best, before.grasp.score);
    }
    for (int first = 0; first < count; first += kAtOnce) {
      if (options_.best_only && best > begun[first].rank + kGain) break;
      const int some = std::min(kAtOnce, count - first);
      const std::size_t at = refined.size();
      refined.resize(at + some);
      if (!RunStage(part.before + (0.8 + 0.2 * first / count) * part.share,
                    0.2 * part.share * some / count, some, [&](int i) {
                      HandEvaluation evaluation = at_wrist_;
                      GraspAttempt attempt = begun[first + i];
                      RefineGrasp(anatomy_, evaluation, distance_, rest, attempt.angles,
                                  attempt.wrist_from_object);
                      GraspReport::Candidate& candidate = refined[at + i];
                      candidate.grasp = Assess(scene_, evaluation, attempt, true);
                      candidate.refused = WhyRefused(scene_, candidate.grasp);
                      if (solid_ && candidate.refused.empty()) {
                        candidate.grasp.score -= LostBySlipping(candidate.grasp, evaluation);
                      }
                    })) {
        return false;
      }
      for (std::size_t i = at; i < refined.size(); ++i) {
        if (refined[i].refused.empty()) best = std::max(best, refined[i].grasp.score);
      }
    }
    out_.refinements = static_cast<int>(refined.size());
    out_.refinement_ms += MillisecondsSince(start);
    return true;
  }

  // For objects that people grasp by the handle: whether one of the best grasps is clean and holds.
  bool HandleIsEnough(const std::vector<GraspReport::Candidate>& refined) const {
    return options_.best_only && scene_.use.kind == GraspUse::kHandle &&
           std::ranges::any_of(refined, [&](const GraspReport::Candidate& candidate) {
             HandEvaluation evaluation = at_wrist_;
             return candidate.refused.empty() &&
                    (!solid_ || Holds(Contacts(evaluation, candidate.grasp.fingers,
                                               candidate.grasp.wrist_from_object)));
           });
  }

  // Score penalty for a grasp that does not hold the object's weight in every direction with the
  // assumed friction, that needs a strong squeeze for it, or that would fail if the mass center
  // were slightly off.
  double LostBySlipping(const Grasp& grasp, HandEvaluation& evaluation) const {
    constexpr double kSlips = 1.5, kSqueezes = 0.3, kOffCenter = 0.1, kOffset = 0.1;
    const std::vector<GraspContact> contacts =
        Contacts(evaluation, grasp.fingers, grasp.wrist_from_object);
    double lost = 0.0;
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector3d offset =
          (k % 2 == 0 ? 1.0 : -1.0) * kOffset * scene_.size * Eigen::Vector3d::Unit(k / 2);
      if (!HoldsGravity(contacts, scene_.centroid + offset, 0.5 * scene_.size, options_.friction,
                        {.most_squeeze = 12.0})) {
        lost += kOffCenter;
      }
    }
    for (const double weights : {6.0, 12.0, CertificateOptions{}.most_squeeze}) {
      if (HoldsGravity(contacts, scene_.centroid, 0.5 * scene_.size, options_.friction,
                       {.most_squeeze = weights})) {
        return lost;
      }
      lost += kSqueezes;
    }
    return kSlips;
  }

  Grasp ReportBest(std::vector<GraspReport::Candidate> refined, const SignedDistance& surface) {
    SortBestFirst(refined);
    HandEvaluation evaluation = at_wrist_;
    if (solid_) {
      Grasp& first = refined.front().grasp;
      first.certificate = Certify(Contacts(evaluation, first.fingers, first.wrist_from_object));
    }
    Grasp best = refined.front().grasp;
    out_.status =
        refined.front().refused.empty() ? GraspStatus::kFound : GraspStatus::kNoCleanGrasp;
    out_.candidates = std::move(refined);
    const Eigen::Matrix3Xd in_object =
        best.wrist_from_object.inverse() * evaluation.At(best.fingers).Vertices();
    ContactProtocol protocol;
    protocol.threads = options_.threads;
    best.metrics =
        MeasureContact(TriangleMesh{in_object, hand_.Surface().Faces()}, surface, protocol);
    out_.candidates.front().grasp.metrics = best.metrics;
    return best;
  }

  Grasp Stopped() {
    out_.status = GraspStatus::kStopped;
    return open_;
  }

  GraspReport& out_;
  const bool solid_;
  Grasp open_;
};

}  // namespace

std::string_view Describe(GraspStatus status) {
  constexpr std::array<std::string_view, 8> kTexts = {
      "found",
      "no two opposing surface points are within a hand's span",
      "at the requested place, no two opposing surface points are within a hand's span",
      "there is no handle that a finger fits through",
      "there is no room for a hand at any graspable place",
      "no acceptable grasp was found",
      "fewer distinct grasps than requested",
      "stopped before the search was complete"};
  return kTexts[static_cast<std::size_t>(status)];
}

std::string_view StyleName(GraspStyle style) {
  return kStyleNames[static_cast<std::size_t>(style)];
}

std::optional<GraspStyle> StyleByName(std::string_view name) {
  const auto found = std::ranges::find(kStyleNames, name);
  if (found == kStyleNames.end()) return std::nullopt;
  return static_cast<GraspStyle>(found - kStyleNames.begin());
}

void AddStyleOption(OptionTable& table, const std::string& name, std::optional<GraspStyle>& style,
                    std::string help) {
  table.Choice(name, style,
               {{"auto", std::nullopt},
                {"power", GraspStyle::kPower},
                {"precision", GraspStyle::kPrecision},
                {"handle", GraspStyle::kHandle}},
               std::move(help));
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
