// SPDX-License-Identifier: MIT
#include "generator/matching/matched_reaches.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "generator/nn/random_stream.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ClipMoment = MotionLibrary::Place;

constexpr int kSearchEvery = 6;  // frames
// A transition needs a cost below this fraction of the current cost.
constexpr float kTransitionRatio = 0.75f;
constexpr int kEarliestEntry = 48;  // frames from the entry to the mark ...
constexpr int kLatestEntry = 15;    // ... at most and at least
constexpr int kUsualEntry = 28;
constexpr double kFastestReach = 1.2;  // limits the playback rate: captured hands are fast enough
// A walker reaches as soon as a captured reach fits its position and motion. The threshold is
// relaxed with the time spent near the target.
constexpr double kNearTarget = 0.9;     // meters
constexpr float kFittingCost = 3.5f;    // maximum cost of an entry
constexpr float kWaitDiscount = 0.25f;  // cost per frame near the target
// The captured return is played while a transition to walking off would be too large.
constexpr int kShortestReturn = 15, kUsualReturn = 26, kLongestReturn = 38;  // frames
constexpr float kReturned = 2.5f;                                            // pose cost
constexpr double kVariety = 1.5;                                             // cost
constexpr double kFrontOnly = 0.2;  // cosine; walkers do not reach for goals behind them

class ReachMatcher {
 public:
  ReachMatcher(const MotionLibrary& library, const MatchedReachOptions& options, std::uint64_t seed)
      : library_(library),
        options_(options),
        draws_(seed),
        rate_(DrawRate()),
        player_(library, Start(), rate_) {
    for (std::size_t k = 0; k < library.Clips().size(); ++k) {
      const LibraryClip& clip = library.Clips()[k];
      if (!clip.reach || clip.reach->wrist != options.wrist) continue;
      if (clip.reach->frame <= kLatestEntry) continue;
      Source reach;
      reach.clip = static_cast<int>(k);
      reach.mark = clip.reach->frame;
      const BodyPlacement placed =
          holdfast::Place(library.RestJoints(), clip.frames[clip.reach->frame]);
      reach.wrist = placed.joints.col(WristJoint(options.wrist));
      reach.variety_cost = static_cast<float>(draws_.Uniform(0.0, kVariety));
      reaches_.push_back(reach);
    }
    if (reaches_.empty()) {
      throw Error("motion library", "has no reach with the requested wrist",
                  "Give clips with a marked reach");
    }
  }

  MatchedReaches Run() {
    player_.Step();
    for (int k = 0; k < options_.reaches; ++k) {
      const bool stays = draws_.Uniform(0.0, 1.0) < options_.without_walking;
      Plan plan = stays ? Plan() : DrawPlan();
      if (k > 0) Return(stays ? PlanStand() : PlanWalk(player_.State(), plan.target));
      rate_ = DrawRate();
      const Entry entry = stays ? NearEntry(plan) : Walk(plan);
      Reach(entry, plan.goal);
    }
    Return(PlanStand());
    Follow(PlanStand(), 5 + draws_.Index(15));
    return {player_.Frames(), player_.Contacts(), player_.Segments(), events_};
  }

 private:
  struct Source {
    int clip, mark;
    Vector3d wrist;      // at the mark, in the world of the clip
    float variety_cost;  // random, so that motions use different reaches
  };
  struct Plan {
    Vector3d goal = Vector3d::Zero();
    WalkTarget target;
  };
  // Frame at which a captured reach is joined.
  struct Entry {
    const Source* reach = nullptr;
    ClipMoment place;
    Vector3d wrist = Vector3d::Zero();  // at its mark, in the generated world
    float cost = std::numeric_limits<float>::infinity();
  };

  static FuturePath WalkOn(double speed) {
    WalkState now;
    now.velocity = speed * Facing(0.0);
    WalkTarget ahead;
    ahead.place = 9.0 * Facing(0.0);
    ahead.speed = speed;
    return PlanWalk(now, ahead);
  }

  double DrawRate() { return options_.pace * draws_.Uniform(options_.slowest, options_.fastest); }

  // Start frame: the best match of a random pose that stands or walks straight ahead.
  ClipMoment Start() {
    const bool walks = draws_.Uniform(0.0, 1.0) < options_.begin_walking;
    const FuturePath path = walks ? WalkOn(draws_.Uniform(0.8, 1.6)) : PlanStand();
    for (;;) {
      const int clip = draws_.Index(static_cast<int>(library_.Clips().size()));
      const int frames = static_cast<int>(library_.Clips()[clip].frames.size());
      const ClipMoment drawn{clip, draws_.Index(frames), 0.0f};
      const ClipMoment found = library_.Search(library_.Query(drawn, path));
      if (found.frame + 20 < static_cast<int>(library_.Clips()[found.clip].frames.size())) {
        return found;
      }
    }
  }

  // Adds one frame along `path`. Searches periodically and at the end of a clip.
  void Advance(const FuturePath& path) {
    const bool at_end = !player_.Frames().empty() && !player_.CanStep();
    if (at_end || since_search_ >= kSearchEvery) {
      since_search_ = 0;
      const ClipMoment at = player_.At();
      const MatchRow query = library_.Query(at, path);
      const ClipMoment best = library_.Search(query);
      const bool same = best.clip == at.clip && std::abs(best.frame - at.frame) < 10;
      if (at_end || (!same && best.cost < kTransitionRatio * library_.Cost(query, at))) {
        player_.Jump(best, rate_, options_.blend_s);
      }
    }
    player_.Step();
    ++since_search_;
  }

  void Follow(const FuturePath& path, int frames) {
    for (int t = 0; t < frames; ++t) Advance(path);
  }

  // Walks until a captured reach fits, or until the body stands and no longer gets nearer.
  Entry Walk(const Plan& plan) {
    const double way = (plan.target.place - player_.State().place).norm();
    const int limit = static_cast<int>(MotionLibrary::kFrameRate * (3.0 + way / 0.5));
    int near = 0, stuck = 0;
    WalkState before = player_.State();
    for (int t = 0; t < limit && stuck < 6; ++t) {
      const WalkState state = player_.State();
      if ((state.place - plan.target.place).norm() < kNearTarget && ++near % 2 == 1) {
        const Entry entry = BestEntry(plan.goal);
        if (entry.cost < kFittingCost + kWaitDiscount * static_cast<float>(near)) return entry;
      }
      Advance(PlanWalk(state, plan.target));
      const double turning = MotionLibrary::kFrameRate *
                             std::abs(std::remainder(state.yaw_rad - before.yaw_rad, 2.0 * M_PI));
      const bool still = t > 15 && state.velocity.norm() < 0.15 && turning < 0.35;
      stuck = still ? stuck + 1 : 0;
      before = state;
    }
    return BestEntry(plan.goal);
  }

  // Draws a goal and a standing position from which a captured reach of about that height fits.
  Plan DrawPlan() {
    const WalkState now = player_.State();
    const double height = draws_.Uniform(options_.lowest_goal, options_.highest_goal);
    std::vector<const Source*> fitting = SourcesAt(height, true);
    if (fitting.empty()) fitting = SourcesAt(height, false);
    const Source& reach = *fitting[draws_.Index(static_cast<int>(fitting.size()))];
    const double angle = draws_.Uniform(-M_PI, M_PI);
    const double distance = draws_.Uniform(options_.nearest_walk, options_.farthest_goal);
    const Vector2d way = distance * Facing(now.yaw_rad + angle);
    Plan plan;
    plan.goal << now.place + way, height;
    // Walkers end roughly facing their walking direction.
    plan.target.yaw_rad = YawToFace(way) + 0.45 * draws_.Normal();
    plan.target.speed =
        options_.pace * draws_.Uniform(options_.slowest_walk, options_.fastest_walk);
    const BodyFrame& entry = EntryFrame(reach);
    const Vector2d from_body = reach.wrist.head<2>() - entry.pelvis.head<2>();
    plan.target.place =
        plan.goal.head<2>() - Eigen::Rotation2Dd(plan.target.yaw_rad - Yaw(entry)) * from_body;
    return plan;
  }

  const BodyFrame& EntryFrame(const Source& reach) const {
    return library_.Clips()[reach.clip].frames[std::max(0, reach.mark - kUsualEntry)];
  }

  // Reaches of about this height, or the nearest ones if there are none.
  std::vector<const Source*> SourcesAt(double height, bool in_front) const {
    std::vector<const Source*> fitting;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Source& reach : reaches_) {
      nearest = std::min(nearest, std::abs(reach.wrist.z() - height));
    }
    for (const Source& reach : reaches_) {
      if (std::abs(reach.wrist.z() - height) > std::max(0.15, nearest)) continue;
      const BodyFrame& entry = EntryFrame(reach);
      const Vector2d from_body = (reach.wrist - entry.pelvis).head<2>().normalized();
      if (!in_front || from_body.dot(Facing(Yaw(entry))) > kFrontOnly) fitting.push_back(&reach);
    }
    return fitting;
  }

  // Visits every frame at which a reach could be joined now, with its cost.
  template <typename Visit>
  void VisitEntries(const Visit& visit) const {
    const ClipMoment at = player_.At();
    for (const Source& reach : reaches_) {
      const int first = std::max(1, reach.mark - kEarliestEntry);
      for (int frame = first; frame <= reach.mark - kLatestEntry; frame += 3) {
        Entry entry;
        entry.reach = &reach;
        entry.place = {reach.clip, frame, 0.0f};
        entry.wrist = player_.MoveFor(entry.place) * reach.wrist;
        // Feet stay on the ground from here on, so a different stance cannot be corrected.
        const double stance = library_.FootDistance(at, entry.place) / 0.05;
        entry.cost = reach.variety_cost + library_.PoseCost(at, entry.place) +
                     static_cast<float>(stance * stance);
        visit(entry);
      }
    }
  }

  Entry BestEntry(const Vector3d& planned) const {
    Entry best;
    VisitEntries([&](Entry entry) {
      const double residual = (entry.wrist - planned).norm() / 0.25;
      entry.cost += static_cast<float>(2.0 * residual * residual);
      if (entry.cost < best.cost) best = entry;
    });
    return best;
  }

  // Draws a goal within reach of the standing body.
  Entry NearEntry(Plan& plan) {
    const double height = draws_.Uniform(options_.lowest_goal, options_.highest_goal);
    Entry best;
    VisitEntries([&](Entry entry) {
      const double off = (entry.wrist.z() - height) / 0.2;
      entry.cost += static_cast<float>(off * off + draws_.Uniform(0.0, 1.5));
      if (entry.cost < best.cost) best = entry;
    });
    plan.goal = best.wrist;
    for (int k = 0; k < 3; ++k) {
      plan.goal(k) += 0.5 * options_.goal_scatter_m * draws_.Uniform(-1.0, 1.0);
    }
    return best;
  }

  // Joins a captured reach and plays it up to its mark.
  void Reach(const Entry& entry, const Vector3d& planned) {
    ReachEvent event;
    event.wrist = options_.wrist;
    event.clip = entry.reach->clip;
    event.begin = static_cast<int>(player_.Frames().size());
    const double lead = entry.reach->mark - entry.place.frame;
    const int steps =
        static_cast<int>(std::lround(lead / std::min(rate_, options_.pace * kFastestReach)));
    player_.Jump(entry.place, lead / steps, options_.blend_s + 0.1);
    event.frame = event.begin + steps;
    for (int t = 0; t <= steps && player_.CanStep(); ++t) player_.Step();
    event.end = static_cast<int>(player_.Frames().size());
    // Limits the goal's distance from the captured wrist to what a warp can correct unnoticed.
    const Vector3d wrist = holdfast::Place(library_.RestJoints(), player_.Frames().back())
                               .joints.col(WristJoint(options_.wrist));
    Vector3d off = planned - wrist;
    if (off.norm() > options_.goal_scatter_m) off *= options_.goal_scatter_m / off.norm();
    event.goal = wrist + off;
    event.goal.z() = std::clamp(event.goal.z(), options_.lowest_goal, options_.highest_goal);
    events_.push_back(event);
    since_search_ = kSearchEvery;
  }

  // Continues the captured reach until a motion along `path` can follow.
  void Return(const FuturePath& path) {
    const int least = kShortestReturn + draws_.Index(kUsualReturn - kShortestReturn);
    for (int t = 1; t < kLongestReturn && player_.CanStep(); ++t) {
      player_.Step();
      if (t < least || t % 2 != 0) continue;
      const ClipMoment at = player_.At();
      if (library_.PoseCost(library_.Search(library_.Query(at, path)), at) < kReturned) break;
    }
    events_.back().end = static_cast<int>(player_.Frames().size());
    since_search_ = kSearchEvery;
  }

  const MotionLibrary& library_;
  const MatchedReachOptions& options_;
  RandomDraws draws_;
  double rate_;
  int since_search_ = 0;
  MotionPlayer player_;
  std::vector<Source> reaches_;
  std::vector<ReachEvent> events_;
};

}  // namespace

MatchedReaches MatchReaches(const MotionLibrary& library, const MatchedReachOptions& options,
                            std::uint64_t seed) {
  return ReachMatcher(library, options, seed).Run();
}

}  // namespace holdfast
