// SPDX-License-Identifier: MIT
#include "generator/matching/reach_synthesis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "generator/matching/random_draws.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Place = MotionLibrary::Place;

constexpr double kRate = MotionLibrary::kFrameRate;
constexpr int kSearchEvery = 6;  // frames
// What another place must be better by, in costs, to be worth a transition.
constexpr float kWorthJumping = 0.75f;
constexpr int kEarliestEntry = 48;  // frames of lead before the mark of a reach ...
constexpr int kLatestEntry = 18;    // ... at most and at least
constexpr int kUsualEntry = 32;
constexpr int kAfterReach = 36;  // frames played after the mark: the hand goes back
constexpr int kStandBetween = 8;

class Synthesis {
 public:
  Synthesis(const MotionLibrary& library, const SynthesisOptions& options, std::uint64_t seed)
      : library_(library), options_(options), draws_(seed), player_(library, Start(), DrawRate()) {
    for (std::size_t k = 0; k < library.Clips().size(); ++k) {
      const LibraryClip& clip = library.Clips()[k];
      if (!clip.reach || clip.reach->wrist != options.wrist) continue;
      if (clip.reach->frame <= kLatestEntry) continue;
      Reach reach;
      reach.clip = static_cast<int>(k);
      reach.mark = clip.reach->frame;
      const BodyPlacement placed =
          holdfast::Place(library.RestJoints(), clip.frames[clip.reach->frame]);
      reach.wrist = placed.joints.col(WristJoint(options.wrist));
      reaches_.push_back(reach);
    }
    if (reaches_.empty()) {
      throw Error("motion library", "has no reach of the wrist asked for",
                  "Give clips with a marked reach");
    }
  }

  SynthesizedMotion Run() {
    Follow(PlanStand(), 6 + draws_.Index(20));
    for (int k = 0; k < options_.reaches; ++k) {
      const Plan plan = DrawPlan();
      Walk(plan.target);
      if (draws_.Uniform(0.0, 1.0) < 0.3) Follow(PlanStand(), draws_.Index(kStandBetween));
      PlayReach(plan.goal);
    }
    Follow(PlanStand(), 15 + draws_.Index(20));
    return {player_.Frames(), player_.Contacts(), player_.Segments(), events_};
  }

 private:
  struct Reach {
    int clip, mark;
    Vector3d wrist;  // at the mark, in the clip's world
  };
  struct Plan {
    Vector3d goal;
    WalkTarget target;
  };

  double DrawRate() { return draws_.Uniform(options_.slowest, options_.fastest); }

  // Somebody who stands: the frame nearest to standing still in a random frame's pose.
  Place Start() {
    for (;;) {
      const int clip = draws_.Index(static_cast<int>(library_.Clips().size()));
      const int frames = static_cast<int>(library_.Clips()[clip].frames.size());
      const Place drawn{clip, draws_.Index(frames), 0.0f};
      const Place found = library_.Search(library_.Query(drawn, PlanStand()));
      if (found.frame + 20 < static_cast<int>(library_.Clips()[found.clip].frames.size())) {
        return found;
      }
    }
  }

  // Adds one frame on the way along `path`; searches where it is time to or the clip ends.
  void Advance(const FuturePath& path) {
    const bool at_end = !player_.Frames().empty() && !player_.CanStep();
    if (at_end || since_search_ >= kSearchEvery) {
      since_search_ = 0;
      const Place at = player_.At();
      const MatchRow query = library_.Query(at, path);
      const Place best = library_.Search(query);
      const bool same = best.clip == at.clip && std::abs(best.frame - at.frame) < 10;
      if (at_end || (!same && best.cost < kWorthJumping * library_.Cost(query, at))) {
        player_.Jump(best, rate_, options_.blend_s);
      }
    }
    player_.Step();
    ++since_search_;
  }

  void Follow(const FuturePath& path, int frames) {
    for (int t = 0; t < frames; ++t) Advance(path);
  }

  // Until the body stands where it was to go, or no longer gets nearer. The reach is then fitted to
  // where it stands: nobody waits for a better place.
  void Walk(const WalkTarget& target) {
    const double way = (target.place - player_.State().place).norm();
    const int limit = static_cast<int>(kRate * (3.0 + way / 0.5));
    int arrived = 0, stuck = 0;
    WalkState before = player_.State();
    for (int t = 0; t < limit && arrived < 3 && stuck < 10; ++t) {
      const WalkState state = player_.State();
      Advance(PlanWalk(state, target));
      const double off = std::remainder(state.yaw_rad - target.yaw_rad, 2.0 * M_PI);
      const double speed = state.velocity.norm();
      const double turning =
          kRate * std::abs(std::remainder(state.yaw_rad - before.yaw_rad, 2.0 * M_PI));
      const bool there =
          (state.place - target.place).norm() < 0.3 && std::abs(off) < 0.6 && speed < 0.3;
      const bool still = t > 15 && speed < 0.15 && turning < 0.35;
      arrived = there ? arrived + 1 : 0;
      stuck = still ? stuck + 1 : 0;
      before = state;
    }
  }

  // A goal, and where to stand for it: where a captured reach of about that height would end.
  Plan DrawPlan() {
    const WalkState now = player_.State();
    const double height = draws_.Uniform(options_.lowest_goal, options_.highest_goal);
    std::vector<const Reach*> fitting;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Reach& reach : reaches_) {
      nearest = std::min(nearest, std::abs(reach.wrist.z() - height));
    }
    for (const Reach& reach : reaches_) {
      if (std::abs(reach.wrist.z() - height) <= std::max(0.15, nearest)) fitting.push_back(&reach);
    }
    const Reach& reach = *fitting[draws_.Index(static_cast<int>(fitting.size()))];
    const double angle = draws_.Uniform(-M_PI, M_PI);
    const double distance = draws_.Uniform(options_.nearest_goal, options_.farthest_goal);
    const Vector2d way = distance * Facing(now.yaw_rad + angle);
    Plan plan;
    plan.goal << now.place + way, height;
    // Walkers end about facing the way they came; the nearer, the less.
    plan.target.yaw_rad = YawToFace(way) + 0.6 * draws_.Normal();
    plan.target.speed = std::clamp(1.2 + 0.25 * draws_.Normal(), 0.7, 1.7);
    const std::vector<BodyFrame>& frames = library_.Clips()[reach.clip].frames;
    const BodyFrame& entry = frames[std::max(0, reach.mark - kUsualEntry)];
    const Vector2d from_body = reach.wrist.head<2>() - entry.pelvis.head<2>();
    plan.target.place =
        plan.goal.head<2>() - Eigen::Rotation2Dd(plan.target.yaw_rad - Yaw(entry)) * from_body;
    rate_ = DrawRate();
    return plan;
  }

  void PlayReach(const Vector3d& planned) {
    const Place at = player_.At();
    float least = std::numeric_limits<float>::infinity();
    Place entry;
    const Reach* chosen = nullptr;
    Vector3d wrist = Vector3d::Zero();
    for (const Reach& reach : reaches_) {
      const int first = std::max(1, reach.mark - kEarliestEntry);
      for (int frame = first; frame <= reach.mark - kLatestEntry; frame += 3) {
        const Place place{reach.clip, frame, 0.0f};
        const Vector3d lands = player_.MoveFor(place) * reach.wrist;
        const double residual = (lands - planned).norm() / 0.25;
        // Feet stay on the ground from here on: they cannot make up for a different stance.
        const double stance = library_.FootDistance(at, place) / 0.07;
        const float cost = library_.PoseCost(at, place) +
                           static_cast<float>(2.0 * residual * residual + stance * stance);
        if (cost < least) {
          least = cost;
          entry = place;
          chosen = &reach;
          wrist = lands;
        }
      }
    }
    ReachEvent event;
    event.wrist = options_.wrist;
    event.clip = chosen->clip;
    event.begin = static_cast<int>(player_.Frames().size());
    const double lead = chosen->mark - entry.frame;
    const int steps = static_cast<int>(std::lround(lead / rate_));
    player_.Jump(entry, lead / steps, options_.blend_s + 0.1);
    event.frame = event.begin + steps;
    for (int t = 0; t <= steps + kAfterReach && player_.CanStep(); ++t) player_.Step();
    event.end = static_cast<int>(player_.Frames().size());
    // No farther from the captured wrist than a warp can carry it without showing.
    Vector3d off = planned - wrist;
    if (off.norm() > options_.goal_scatter_m) off *= options_.goal_scatter_m / off.norm();
    event.goal = wrist + off;
    event.goal.z() = std::clamp(event.goal.z(), options_.lowest_goal, options_.highest_goal);
    if (event.frame < event.end) events_.push_back(event);
    since_search_ = kSearchEvery;
  }

  const MotionLibrary& library_;
  const SynthesisOptions& options_;
  RandomDraws draws_;
  double rate_ = 1.0;
  int since_search_ = 0;
  MotionPlayer player_;
  std::vector<Reach> reaches_;
  std::vector<ReachEvent> events_;
};

}  // namespace

SynthesizedMotion SynthesizeReaches(const MotionLibrary& library, const SynthesisOptions& options,
                                    std::uint64_t seed) {
  return Synthesis(library, options, seed).Run();
}

}  // namespace holdfast
