// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>
#include <utility>

#include "geometry/parallel.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_handle_placement.h"
#include "solver/grasp/grasp_refinement.h"

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
        of_style.emplace_back(
            placement.prior *
                std::exp(UprightWeight(scene, style) * upright -
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
  Eigen::Isometry3d world_from_wrist = Eigen::Isometry3d::Identity();
  world_from_wrist.linear() = wrist_rotation;
  world_from_wrist.translation() = wrist_position;
  return world_from_wrist * grasp.wrist_from_object;
}

Grasp CloseHand(const HandModel& hand, const TriangleMesh& object, const SignedDistance& surface,
                const DistanceGrid& distance, const GraspOptions& options, GraspReport* report,
                const GraspProgress& progress) {
  GraspReport unused;
  GraspReport& out = report ? *report : unused;
  out = {};
  const HandAnatomy anatomy(hand);
  const GraspPlacer placer(anatomy);
  GraspScene scene(anatomy, placer, distance, object, options);
  Grasp open;
  open.fingers = anatomy.axes.PoseOf(OpenHand(anatomy.axes));

  // One stage of the search: work(i) writes slot i only, so that the order does not matter.
  std::mutex progress_mutex;
  bool cancelled = false;
  const auto run_stage = [&](double share_before, double share, int count, const auto& work) {
    int done = 0;
    ParallelFor(count, options.threads, [&](int i) {
      {
        const std::lock_guard lock(progress_mutex);
        if (cancelled) return;
      }
      work(i);
      if (!progress) return;
      const std::lock_guard lock(progress_mutex);
      cancelled |= !progress(share_before + share * ++done / count);
    });
    if (cancelled) out.status = GraspStatus::kStopped;
    return !cancelled;
  };

  // Where a hand could go.
  Clock::time_point stage = Clock::now();
  OppositionOptions opposition_options;
  opposition_options.count = options.oppositions;
  opposition_options.seed = options.seed;
  std::vector<Opposition> oppositions;
  if (options.place) {
    opposition_options.allowed = [&](const Eigen::Vector3d& x) { return options.place->Allows(x); };
  }
  if (options.style != GraspStyle::kHandle) {
    oppositions = FindOppositions(options.place ? options.place->Surface() : object, distance,
                                  scene.held_at, opposition_options);
  }
  if (!options.style || options.style == GraspStyle::kHandle) {
    HandleOptions handle_options;
    handle_options.threads = options.threads;
    scene.handles = FindHandles(distance, handle_options);
    std::erase_if(scene.handles, [&](const Handle& handle) {
      return options.place && !options.place->Allows(handle.bar);
    });
  }
  out.oppositions = static_cast<int>(oppositions.size());
  out.handles = static_cast<int>(scene.handles.size());
  if (oppositions.empty() && scene.handles.empty()) {
    if (options.place) out.status = GraspStatus::kNothingAtPlace;
    if (options.style == GraspStyle::kHandle) out.status = GraspStatus::kNoHandle;
    return open;
  }
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Opposition& opposition : oppositions) thinnest = std::min(thinnest, opposition.width);
  const GraspPlacer::Target target{distance, scene.size, std::clamp(0.2 * thinnest, 0.0005, 0.003)};
  ClosingOptions closing_options;
  closing_options.allowed_depth = std::min(closing_options.allowed_depth, target.allowed_depth);
  std::vector<std::vector<Placement>> placed(out.oppositions + out.handles);
  std::optional<HandlePlacer> handle_placer;
  if (out.handles > 0) handle_placer.emplace(anatomy);
  if (!run_stage(0.0, 0.2, out.oppositions + out.handles, [&](int i) {
        const int h = i - out.oppositions;
        placed[i] = h < 0 ? placer.Place(oppositions[i], target, options.turns)
                          : handle_placer->Place(scene.handles, h, distance);
      })) {
    return open;
  }
  std::vector<Placement> queue, by_handle;
  for (const std::vector<Placement>& placements : placed) {
    out.placements += static_cast<int>(placements.size());
  }
  queue = MostPromising(scene, {placed.data(), oppositions.size()}, options.closings);
  by_handle = MostPromising(scene, {placed.data() + out.oppositions, scene.handles.size()},
                            options.closings / 2);
  const std::size_t around = queue.size();
  queue.insert(queue.end(), by_handle.begin(), by_handle.end());
  out.search_ms = MillisecondsSince(stage);
  if (queue.empty()) {
    out.status = GraspStatus::kNoRoom;
    return open;
  }

  stage = Clock::now();
  out.closings = static_cast<int>(queue.size());
  std::vector<GraspAttempt> attempts(queue.size());
  if (!run_stage(0.2, 0.4, out.closings, [&](int i) {
        HandEvaluation evaluation = AtWrist(hand);
        const Placement& placement = queue[i];
        ClosingOptions closing_of_this = closing_options;
        closing_of_this.fingers = placement.closing;
        const Closing closing =
            CloseFingers(anatomy, evaluation, distance, placement.wrist_from_object,
                         placement.start, closing_of_this);
        attempts[i] = {placement.style, closing.angles, placement.wrist_from_object,
                       placement.handle};
        attempts[i].rank = Assess(scene, evaluation, attempts[i], false).score;
      })) {
    return open;
  }
  // The best of both kinds are refined: what is through a handle is not compared with what is not
  // before it has settled.
  const auto better = [](const GraspAttempt& a, const GraspAttempt& b) { return a.rank > b.rank; };
  std::stable_sort(attempts.begin(), attempts.begin() + around, better);
  std::stable_sort(attempts.begin() + around, attempts.end(), better);
  const auto keep = [&](std::size_t begin, std::size_t end, int count) {
    const std::size_t kept = std::min<std::size_t>(end - begin, count);
    attempts.erase(attempts.begin() + begin + kept, attempts.begin() + end);
    return kept;
  };
  const std::size_t kept_around = keep(0, around, options.refinements);
  keep(kept_around, attempts.size(), std::max(1, options.refinements / 2));
  out.closing_ms = MillisecondsSince(stage);

  stage = Clock::now();
  out.refinements = static_cast<int>(attempts.size());
  std::vector<GraspReport::Candidate> refined(out.refinements);
  if (!run_stage(0.6, 0.4, out.refinements, [&](int i) {
        HandEvaluation evaluation = AtWrist(hand);
        GraspAttempt attempt = attempts[i];
        RefineGrasp(anatomy, evaluation, distance, {}, attempt.angles, attempt.wrist_from_object);
        refined[i].grasp = Assess(scene, evaluation, attempt, true);
        refined[i].refused = WhyRefused(scene, refined[i].grasp);
      })) {
    return open;
  }
  std::stable_sort(refined.begin(), refined.end(), [](const auto& a, const auto& b) {
    if (a.refused.empty() != b.refused.empty()) return a.refused.empty();
    return a.grasp.score > b.grasp.score;
  });
  Grasp best = refined.front().grasp;
  out.status = refined.front().refused.empty() ? GraspStatus::kFound : GraspStatus::kNoCleanGrasp;
  out.candidates = std::move(refined);

  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd in_object =
      best.wrist_from_object.inverse() * evaluation.At(best.fingers.data(), false).Vertices();
  best.metrics = MeasureContact(TriangleMesh{in_object, hand.Surface().Faces()}, surface);
  out.candidates.front().grasp.metrics = best.metrics;
  out.refinement_ms = MillisecondsSince(stage);
  return best;
}

}  // namespace holdfast
