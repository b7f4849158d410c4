// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_set.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_handle_placement.h"
#include "solver/grasp/grasp_refinement.h"

namespace holdfast {
namespace {

constexpr int kPlacesAtOnce = 16;  // placed before hands are closed there
constexpr int kHandsAtOnce = 64;   // closed and refined before it is counted who is distinct

// One call of FindGrasps.
class GraspSampler {
 public:
  GraspSampler(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
               const GraspSetOptions& options, const GraspProgress& progress, GraspSet& set)
      : hand_(hand),
        object_(object),
        distance_(distance),
        options_(options),
        progress_(progress),
        out_(set),
        anatomy_(hand),
        placer_(anatomy_),
        scene_(anatomy_, placer_, distance, object, options.search) {}

  void Run();

 private:
  struct Place {
    std::optional<Opposition> opposition;  // none: at a handle
    int handle = -1;
  };

  std::vector<Place> FindPlaces(int sampling);
  std::vector<Placement> PlaceHands(const std::vector<Place>& places, std::size_t begin,
                                    std::size_t end, double allowed_depth);
  struct Trial {
    bool refined = false;
    std::optional<CertifiedGrasp> valid;
  };
  Trial Try(const Placement& placement, double allowed_depth) const;
  bool IsNew(const Eigen::Isometry3d& wrist_from_object) const;
  // False when there are enough, or the search is to stop.
  bool Sample(int sampling);
  bool CloseAndKeep(std::vector<Placement> placements, double allowed_depth);
  bool GoOn(double share);

  const HandModel& hand_;
  const TriangleMesh& object_;
  const DistanceGrid& distance_;
  const GraspSetOptions& options_;
  const GraspProgress& progress_;
  GraspSet& out_;
  const HandAnatomy anatomy_;
  const GraspPlacer placer_;
  GraspScene scene_;
  std::optional<HandlePlacer> handle_placer_;
  std::mutex mutex_;
  bool stopped_ = false;
};

bool GraspSampler::GoOn(double share) {
  const std::lock_guard lock(mutex_);
  if (progress_ && !stopped_) stopped_ = !progress_(std::min(share, 1.0));
  return !stopped_;
}

std::vector<GraspSampler::Place> GraspSampler::FindPlaces(int sampling) {
  const GraspOptions& search = options_.search;
  std::vector<Place> places;
  if (sampling == 0 && search.style.value_or(GraspStyle::kHandle) == GraspStyle::kHandle) {
    scene_.LookForHandles();
    for (std::size_t h = 0; h < scene_.handles.size(); ++h) {
      places.push_back({std::nullopt, static_cast<int>(h)});
    }
    if (!places.empty()) handle_placer_.emplace(anatomy_);
  }
  if (search.style == GraspStyle::kHandle) return places;
  OppositionOptions opposition_options;
  opposition_options.samples = 4 * opposition_options.samples;
  opposition_options.count = std::numeric_limits<int>::max();
  opposition_options.seed = search.seed + static_cast<std::uint64_t>(sampling);
  if (search.place) {
    opposition_options.allowed = [&](const Eigen::Vector3d& x) { return search.place->Allows(x); };
  }
  for (const Opposition& opposition :
       FindOppositions(search.place ? search.place->Surface() : object_, distance_, scene_.held_at,
                       opposition_options)) {
    places.push_back({opposition, -1});
  }
  return places;
}

// Open hands at places[begin, end), the most promising first, without those near to a better one
// or to a grasp that is there.
std::vector<Placement> GraspSampler::PlaceHands(const std::vector<Place>& places, std::size_t begin,
                                                std::size_t end, double allowed_depth) {
  const GraspOptions& search = options_.search;
  const GraspPlacer::Target target{distance_, scene_.size, allowed_depth};
  std::vector<std::vector<Placement>> placed(end - begin);
  const double share = static_cast<double>(out_.grasps.size()) / options_.count;
  ParallelFor(static_cast<int>(placed.size()), search.threads, [&](int i) {
    if (!GoOn(share)) return;
    const Place& place = places[begin + i];
    placed[i] = place.opposition ? placer_.Place(*place.opposition, target, search.turns)
                                 : handle_placer_->Place(scene_.handles, place.handle, distance_);
  });
  std::vector<Placement> queue;
  for (const std::vector<Placement>& placements : placed) {
    out_.placements += static_cast<int>(placements.size());
    for (const Placement& placement : placements) {
      if (!search.style || placement.style == *search.style) queue.push_back(placement);
    }
  }
  std::stable_sort(queue.begin(), queue.end(),
                   [](const Placement& a, const Placement& b) { return a.prior > b.prior; });
  std::vector<Placement> distinct;
  for (const Placement& placement : queue) {
    const auto near = [&](const Placement& other) {
      return !AreDistinct(placement.wrist_from_object, other.wrist_from_object, options_.apart_m,
                          options_.apart_rad);
    };
    if (IsNew(placement.wrist_from_object) &&
        std::none_of(distinct.begin(), distinct.end(), near)) {
      distinct.push_back(placement);
    }
  }
  return distinct;
}

bool GraspSampler::IsNew(const Eigen::Isometry3d& wrist_from_object) const {
  return std::all_of(out_.grasps.begin(), out_.grasps.end(), [&](const CertifiedGrasp& other) {
    return AreDistinct(wrist_from_object, other.grasp.wrist_from_object, options_.apart_m,
                       options_.apart_rad);
  });
}

// Closes, refines and judges one hand.
GraspSampler::Trial GraspSampler::Try(const Placement& placement, double allowed_depth) const {
  const GraspOptions& search = options_.search;
  HandEvaluation evaluation = AtWrist(hand_);
  ClosingOptions closing_options;
  closing_options.allowed_depth = std::min(closing_options.allowed_depth, allowed_depth);
  closing_options.fingers = placement.closing;
  const Closing closing = CloseFingers(anatomy_, evaluation, distance_, placement.wrist_from_object,
                                       placement.start, closing_options);
  GraspAttempt attempt{placement.style, closing.angles, placement.wrist_from_object,
                       placement.handle};
  const auto contacts = [&] {
    return PadContacts(anatomy_, evaluation, distance_, anatomy_.axes.PoseOf(attempt.angles),
                       attempt.wrist_from_object, search.touch_distance_m);
  };
  const auto holds = [&](const std::vector<GraspContact>& touching) {
    return HoldsGravity(touching, scene_.centroid, 0.5 * scene_.size, search.friction);
  };
  if (!closing.finger_touching[kThumb] || !holds(contacts())) return {};

  RefineGrasp(anatomy_, evaluation, distance_, {}, attempt.angles, attempt.wrist_from_object);
  CertifiedGrasp found;
  found.contacts = contacts();
  if (!holds(found.contacts)) return {true, std::nullopt};
  for (const bool thorough : {false, true}) {
    found.grasp = Assess(scene_, evaluation, attempt, thorough);
    if (std::max(found.grasp.max_penetration_mm, found.grasp.object_in_hand_mm) >=
            1000.0 * options_.max_penetration_m ||
        !WhyRefused(scene_, found.grasp).empty()) {
      return {true, std::nullopt};
    }
  }
  CertificateOptions certificate_options;
  certificate_options.friction = search.friction;
  found.grasp.certificate =
      CertifyContacts(found.contacts, scene_.centroid, 0.5 * scene_.size, certificate_options);
  return {true, std::move(found)};
}

bool GraspSampler::CloseAndKeep(std::vector<Placement> placements, double allowed_depth) {
  for (std::size_t begin = 0; begin < placements.size(); begin += kHandsAtOnce) {
    const std::size_t count = std::min<std::size_t>(kHandsAtOnce, placements.size() - begin);
    std::vector<Trial> trials(count);
    const double share = static_cast<double>(out_.grasps.size()) / options_.count;
    ParallelFor(static_cast<int>(count), options_.search.threads, [&](int i) {
      const Placement& placement = placements[begin + i];
      if (GoOn(share)) trials[i] = Try(placement, allowed_depth);
    });
    if (stopped_) return false;
    out_.closings += static_cast<int>(count);
    for (Trial& trial : trials) {
      out_.refinements += trial.refined;
      if (!trial.valid || !IsNew(trial.valid->grasp.wrist_from_object)) continue;
      out_.grasps.push_back(std::move(*trial.valid));
      if (static_cast<int>(out_.grasps.size()) == options_.count) return false;
    }
  }
  return true;
}

bool GraspSampler::Sample(int sampling) {
  const std::vector<Place> places = FindPlaces(sampling);
  ++out_.samplings;
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Place& place : places) {
    if (place.opposition) thinnest = std::min(thinnest, place.opposition->width);
  }
  const double allowed_depth = std::clamp(0.2 * thinnest, 0.0005, 0.003);
  if (!places.empty() && out_.status == GraspStatus::kNothingToGrasp) {
    out_.status = GraspStatus::kNoRoom;
  }
  for (std::size_t begin = 0; begin < places.size(); begin += kPlacesAtOnce) {
    std::vector<Placement> placements =
        PlaceHands(places, begin, std::min(places.size(), begin + kPlacesAtOnce), allowed_depth);
    if (stopped_) return false;
    if (!placements.empty()) out_.status = GraspStatus::kNoCleanGrasp;
    if (!CloseAndKeep(std::move(placements), allowed_depth)) return false;
  }
  return true;
}

void GraspSampler::Run() {
  const auto start = std::chrono::steady_clock::now();
  out_.mass_center = scene_.centroid;
  const GraspOptions& search = options_.search;
  if (search.place) out_.status = GraspStatus::kNothingAtPlace;
  if (search.style == GraspStyle::kHandle) out_.status = GraspStatus::kNoHandle;
  for (int sampling = 0; sampling < options_.samplings; ++sampling) {
    const std::size_t before = out_.grasps.size();
    if (!Sample(sampling)) break;
    if (50 * (out_.grasps.size() - before) < out_.grasps.size() || out_.grasps.empty()) break;
  }
  std::stable_sort(out_.grasps.begin(), out_.grasps.end(),
                   [](const auto& a, const auto& b) { return a.grasp.score > b.grasp.score; });
  if (!out_.grasps.empty()) {
    const bool enough = static_cast<int>(out_.grasps.size()) == options_.count;
    out_.status = enough ? GraspStatus::kFound : GraspStatus::kFewer;
  }
  if (stopped_) out_.status = GraspStatus::kStopped;
  out_.milliseconds =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

bool AreDistinct(const Eigen::Isometry3d& wrist_from_object, const Eigen::Isometry3d& other,
                 double apart_m, double apart_rad) {
  const Eigen::Matrix3d turn = wrist_from_object.linear().transpose() * other.linear();
  if (0.5 * (turn.trace() - 1.0) <= std::cos(apart_rad)) return true;
  const auto wrist = [](const Eigen::Isometry3d& pose) {
    return Eigen::Vector3d(pose.linear().transpose() * pose.translation());
  };
  return (wrist(wrist_from_object) - wrist(other)).norm() >= apart_m;
}

GraspSet FindGrasps(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
                    const GraspSetOptions& options, const GraspProgress& progress) {
  const auto require = [](bool valid, const char* what, const char* instead) {
    if (!valid) throw Error("grasps", what, instead);
  };
  require(options.count > 0, "no grasp is asked for", "Ask for one at least");
  require(options.apart_m >= 0.0 && options.apart_rad >= 0.0 && options.max_penetration_m > 0.0,
          "distances and angles are not positive", "Use the defaults of GraspSetOptions");
  if (const std::string why = WhyNotSolid(object); !why.empty()) {
    throw Error("object", why + ": whether a grasp holds it cannot be certified",
                "Give a closed mesh");
  }
  GraspSet set;
  GraspSampler(hand, object, distance, options, progress, set).Run();
  return set;
}

}  // namespace holdfast
