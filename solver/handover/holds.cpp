// SPDX-License-Identifier: MIT
#include "solver/handover/holds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/conventions/hand_evidence.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/finger_repair.h"
#include "solver/handover/handover_search.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kNumStates = 4;            // a state is the bitmask of holding hands
constexpr double kEvidenceRate = 30.0;   // costs are per 1 / this seconds
constexpr double kSmoothing_s = 0.05;    // standard deviation of the Gaussian over time
constexpr double kSlopeWindow_s = 0.10;  // to either side, for speeds
constexpr double kHeldWindow_s = 0.5;    // to either side, for the object's position in a hand
constexpr int kTouchingVertices = 8;     // about a fingertip
constexpr double kMaxAgainst = 12.0;     // nats of evidence in one frame
constexpr double kMaxFor = 3.0;
constexpr double kAway = 100.0;            // meters
constexpr double kContact_m = 0.010;       // contact threshold for skin, before noise allowance
constexpr double kContactScale_m = 0.005;  // distance that costs one nat of the log-odds of holding
constexpr double kStill_m_s = 0.06;        // maximum speed of an object at rest, before noise
constexpr double kChangeCost = 8.0;  // nats per start or end of a hold: about 0.1 s to the contrary

// The object relative to one hand, one column or entry per frame.
struct HandView {
  Eigen::VectorXd gap;         // meters, 0 if skin touches or is inside
  Eigen::Matrix3Xd wrist;      // world
  Eigen::Matrix3Xd center;     // of the object, in the wrist frame
  std::vector<Matrix3d> turn;  // wrist from object
};

HandView View(const Clip& clip, const HandModel& hand, const DistanceGrid& object, int threads) {
  const int frames = clip.NumFrames();
  const Vector3d middle = 0.5 * (object.Min() + object.Max());
  HandView view{Eigen::VectorXd(frames), Eigen::Matrix3Xd(3, frames), Eigen::Matrix3Xd(3, frames),
                std::vector<Matrix3d>(static_cast<std::size_t>(frames))};
  ForEachPosedHand(clip, hand, threads, [&](int t, const HandState& state) {
    const Matrix3d world_from_object = ExpSO3(clip.object->orient.col(t));
    const Matrix3d wrist_from_world = state.WristRotation().transpose();
    view.wrist.col(t) = state.WristPosition();
    view.turn[t] = wrist_from_world * world_from_object;
    view.center.col(t) = wrist_from_world * (world_from_object * middle +
                                             clip.object->trans.col(t) - state.WristPosition());
    const Eigen::Matrix3Xd skin =
        world_from_object.transpose() * (state.Vertices().colwise() - clip.object->trans.col(t));
    std::vector<double> distance(static_cast<std::size_t>(skin.cols()));
    for (Eigen::Index i = 0; i < skin.cols(); ++i) {
      distance[i] = std::max(0.0, object.Distance(skin.col(i)));
    }
    const int nearest = std::min<int>(kTouchingVertices, static_cast<int>(distance.size()));
    if (nearest == 0) {  // the model lacks this hand
      view.gap(t) = kAway;
      return;
    }
    std::partial_sort(distance.begin(), distance.begin() + nearest, distance.end());
    double sum = 0.0;
    for (int i = 0; i < nearest; ++i) sum += distance[i];
    view.gap(t) = sum / nearest;
  });
  return view;
}

// Distance of the object, per frame, from its position in this hand in the nearest held frames;
// infinite if there are none within the window.
Eigen::VectorXd DistanceFromHeld(const Eigen::Matrix3Xd& center, const std::vector<bool>& held,
                                 Eigen::Index reach) {
  const Eigen::Index frames = center.cols();
  Eigen::VectorXd distance(frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    // The nearest held frame, and the part of that hold around it.
    Eigen::Index nearest = -1;
    for (Eigen::Index k = 0; k <= reach && nearest < 0; ++k) {
      if (t - k >= 0 && held[t - k])
        nearest = t - k;
      else if (t + k < frames && held[t + k])
        nearest = t + k;
    }
    distance(t) = std::numeric_limits<double>::infinity();
    if (nearest < 0) continue;
    Eigen::Index begin = nearest, end = nearest + 1;
    while (begin > 0 && held[begin - 1] && nearest - begin < reach) --begin;
    while (end < frames && held[end] && end - nearest < reach) ++end;
    Vector3d place;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (Eigen::Index u = begin; u < end; ++u) values.push_back(center(axis, u));
      place(axis) = Median(std::move(values));
    }
    distance(t) = (center.col(t) - place).norm();
  }
  return distance;
}

// Time windows for a clip's frame rate.
struct ClipWindows {
  explicit ClipWindows(double frame_rate)
      : fps(frame_rate),
        sigma_frames(std::max(0.3, kSmoothing_s * fps)),
        slope_reach(Frames(kSlopeWindow_s)),
        smoothed(NoiseAfterSmoothing(sigma_frames)),
        slope_noise(fps * NoiseOfSlope(slope_reach)) {}

  Eigen::Index Frames(double seconds) const {
    return std::max<Eigen::Index>(1, std::lround(seconds * fps));
  }
  Eigen::VectorXd Speed(const Eigen::Matrix3Xd& slopes) const {
    return fps * slopes.colwise().norm();
  }

  double fps;
  double sigma_frames;
  Eigen::Index slope_reach;
  // Factor on one frame's noise after smoothing, and in a slope.
  double smoothed, slope_noise;
};

// Nats against a state in which no hand holds the object, per frame: an object that moves is held.
Eigen::VectorXd CostsOfFlying(const Clip& clip, const DistanceGrid& object,
                              const ClipWindows& windows) {
  const Eigen::Index frames = clip.NumFrames();
  const Vector3d middle = 0.5 * (object.Min() + object.Max());
  Eigen::Matrix3Xd in_world(3, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    in_world.col(t) = ExpSO3(clip.object->orient.col(t)) * middle + clip.object->trans.col(t);
  }
  const double still = kStill_m_s + 2.5 * WhiteNoise(in_world) * windows.slope_noise;
  Eigen::VectorXd cost = windows.Speed(SlopesOverTime(in_world, windows.slope_reach));
  for (double& speed : cost) speed = std::clamp(4.0 * (speed / still - 1.0), 0.0, 8.0);
  return cost;
}

// Log-odds that one hand holds, and their sources.
struct HandEvidence {
  Eigen::VectorXd contact, motion;
  double noise = 0.0;
  Eigen::Matrix3Xd center;  // that of HandView, smoothed
};

// Log-odds from the object's motion in the hand's frame. `radius`: lever of its rotation.
Eigen::VectorXd MotionOdds(const HandView& view, double noise, double radius,
                           const ClipWindows& windows) {
  const Eigen::Index frames = view.gap.size();
  const Eigen::VectorXd moves = windows.Speed(SlopesOverTime(view.center, windows.slope_reach));
  const Eigen::VectorXd turns = windows.Speed(
      SlopesOverTime(frames, windows.slope_reach, [&](Eigen::Index t, Eigen::Index u) {
        return Vector3d(radius * LogSO3(view.turn[t].transpose() * view.turn[u]));
      }));
  const Eigen::VectorXd wrist_speed =
      windows.Speed(SlopesOverTime(view.wrist, windows.slope_reach));
  const double still = kStill_m_s + 2.5 * noise * windows.slope_noise;
  Eigen::VectorXd motion(frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const double relative = std::max(moves(t), turns(t) - still);
    // Being still together is no evidence: weight by the hand's own speed.
    const double telling = std::min(1.0, wrist_speed(t) / (3.0 * still));
    motion(t) = relative < still ? 2.0 * telling * (1.0 - relative / still)
                                 : std::max(-8.0, -4.0 * (relative / still - 1.0));
  }
  return motion;
}

HandEvidence WeighHand(const HandView& view, double radius, const ClipWindows& windows) {
  HandEvidence evidence;
  evidence.noise = WhiteNoise(view.center);
  evidence.center = GaussianFilter(view.center, windows.sigma_frames);
  const Eigen::VectorXd gap =
      GaussianFilter(view.gap.transpose(), windows.sigma_frames).transpose();
  const double touching = kContact_m + evidence.noise * windows.smoothed;
  const double scale = kContactScale_m + evidence.noise * windows.smoothed;
  evidence.contact = ((touching - gap.array()) / scale).cwiseMin(kMaxFor).cwiseMax(-kMaxAgainst);
  evidence.motion = MotionOdds(view, evidence.noise, radius, windows);
  return evidence;
}

// Decides the holding hands per frame from the log-odds of both hands.
StatePath DecideHands(const std::array<Eigen::VectorXd, 2>& odds, const Eigen::VectorXd& flying,
                      double fps) {
  const double rate = kEvidenceRate / fps;
  Eigen::Matrix4d change;
  for (int a = 0; a < kNumStates; ++a) {
    for (int b = 0; b < kNumStates; ++b) {
      change(a, b) = kChangeCost * ((a ^ b) == 0 ? 0 : (a ^ b) == 3 ? 2 : 1);
    }
  }
  const Eigen::Index frames = flying.size();
  Eigen::MatrixXd costs(kNumStates, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    for (int state = 0; state < kNumStates; ++state) {
      double cost = state == 0 ? flying(t) : 0.0;
      for (int h = 0; h < 2; ++h) cost += 0.5 * ((state >> h & 1) != 0 ? -1.0 : 1.0) * odds[h](t);
      costs(state, t) = rate * cost;
    }
  }
  return ViterbiPath(costs, change);
}

// Log-odds of hand `h` given its held frames, and thus its position on the object: a hand elsewhere
// relative to the object has not taken it yet, or has released it.
Eigen::VectorXd OddsByPlace(const HandEvidence& evidence, const std::vector<int>& states, int h,
                            const ClipWindows& windows) {
  constexpr double kSlack = 0.012;  // allowed shift of an object in a hand, meters
  const Eigen::Index frames = evidence.center.cols();
  std::vector<bool> held(static_cast<std::size_t>(frames));
  for (Eigen::Index t = 0; t < frames; ++t) held[t] = (states[t] >> h & 1) != 0;
  const Eigen::VectorXd away =
      DistanceFromHeld(evidence.center, held, windows.Frames(kHeldWindow_s));
  const double allowed = kSlack + 2.5 * evidence.noise * windows.smoothed;
  Eigen::VectorXd odds = evidence.contact + evidence.motion;
  for (Eigen::Index t = 0; t < frames; ++t) {
    if (!std::isfinite(away(t))) continue;
    const double ratio = away(t) / allowed;
    odds(t) += std::max(-kMaxAgainst, 1.5 * (1.0 - ratio * ratio));
  }
  return odds;
}

// `between` (3 x T): from one wrist to the other.
HoldLabels HoldingOf(const StatePath& path, const Eigen::Matrix3Xd& between,
                     const ClipWindows& windows) {
  const auto frames = static_cast<Eigen::Index>(path.states.size());
  HoldLabels holding;
  for (Eigen::Index t = 0; t < frames; ++t) {
    holding.hands.push_back(static_cast<std::uint8_t>(path.states[t]));
    holding.confidence.push_back(path.posterior(path.states[t], t));
  }
  holding.switches = SwitchesOf(holding.hands);
  for (HandSwitch& change_of_hands : holding.switches) {
    // Mean confidence of the surrounding frames.
    const Eigen::Index reach = windows.Frames(0.25);
    const Eigen::Index begin = std::max<Eigen::Index>(0, change_of_hands.frame - reach);
    const Eigen::Index end = std::min(frames, change_of_hands.frame + reach + 1);
    double sum = 0.0;
    for (Eigen::Index t = begin; t < end; ++t) sum += holding.confidence[t];
    change_of_hands.confidence = sum / static_cast<double>(end - begin);
    if (change_of_hands.both_begin == change_of_hands.both_end) continue;
    // The hands' approach and parting give the time more precisely than the contacts.
    change_of_hands.frame = DwellMiddle(between, windows.fps, change_of_hands);
  }
  return holding;
}

}  // namespace

HoldLabels FindHolds(const Clip& clip, const HandModel& right, const HandModel& left,
                     const DistanceGrid& object, int threads) {
  if (!clip.object) {
    throw Error("clip", "has no object trajectory, which is needed to find the holding hand",
                "Fit the object first");
  }
  if (right.HandSide() != Side::kRight || left.HandSide() != Side::kLeft) {
    throw Error("hands", "are not a right and a left hand", "Give one of each");
  }
  const ClipWindows windows(clip.frame_rate);
  const double radius = 0.25 * (object.Max() - object.Min()).norm();  // lever of its rotation
  const Eigen::VectorXd flying = CostsOfFlying(clip, object, windows);
  const std::array<HandView, 2> views = {View(clip, right, object, threads),
                                         View(clip, left, object, threads)};
  const std::array<HandEvidence, 2> hands = {WeighHand(views[0], radius, windows),
                                             WeighHand(views[1], radius, windows)};
  const auto decide = [&](const std::array<Eigen::VectorXd, 2>& odds) {
    return DecideHands(odds, flying, windows.fps);
  };
  const StatePath first =
      decide({hands[0].contact + hands[0].motion, hands[1].contact + hands[1].motion});
  const StatePath path = decide({OddsByPlace(hands[0], first.states, 0, windows),
                                 OddsByPlace(hands[1], first.states, 1, windows)});
  return HoldingOf(path, views[0].wrist - views[1].wrist, windows);
}

HeldFrames CountHeld(std::span<const std::uint8_t> hands) {
  HeldFrames frames;
  for (const std::uint8_t bits : hands) {
    ++(bits == kHoldsRight                ? frames.right
       : bits == kHoldsLeft               ? frames.left
       : bits == kHoldsRight + kHoldsLeft ? frames.both
                                          : frames.none);
  }
  return frames;
}

std::string HoldersText(const HeldFrames& frames) {
  const std::pair<const char*, int> kinds[] = {{"the right hand", frames.right},
                                               {"the left hand", frames.left},
                                               {"both hands", frames.both}};
  std::vector<std::string> parts;
  for (const auto& [who, count] : kinds) {
    if (count > 0 && count == frames.Total())
      return fmt::format("{} through {} frames", who, count);
    if (count > 0) parts.push_back(fmt::format("{} in {}", who, count));
  }
  if (parts.empty()) return fmt::format("no hand in {} frames", frames.Total());
  const std::string last = std::move(parts.back());
  parts.pop_back();
  return fmt::format("{}{}{} of {} frames", fmt::join(parts, ", "), parts.empty() ? "" : " and ",
                     last, frames.Total());
}

std::vector<HandSwitch> SwitchesOf(const std::vector<std::uint8_t>& hands) {
  std::vector<HandSwitch> switches;
  int last = 0;        // last hand that held alone
  int last_frame = 0;  // last frame of that
  for (int t = 0; t < static_cast<int>(hands.size()); ++t) {
    const int now = hands[t];
    if (now != kHoldsRight && now != kHoldsLeft) continue;
    if (last != 0 && now != last) {
      HandSwitch change;
      change.from = last == kHoldsRight ? Side::kRight : Side::kLeft;
      change.to = OtherSide(change.from);
      change.both_begin = change.both_end = t;
      for (int u = last_frame + 1; u < t; ++u) {
        if (hands[u] != (kHoldsRight | kHoldsLeft)) continue;
        change.both_begin = std::min(change.both_begin, u);
        change.both_end = std::max(u + 1, change.both_begin + 1);
      }
      if (change.both_begin == t) change.both_end = t;
      change.frame =
          change.both_begin < change.both_end ? (change.both_begin + change.both_end) / 2 : t;
      change.confidence = 1.0;
      switches.push_back(change);
    }
    last = now;
    last_frame = t;
  }
  return switches;
}

}  // namespace holdfast
