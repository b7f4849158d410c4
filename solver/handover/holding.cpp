// SPDX-License-Identifier: MIT
#include "solver/handover/holding.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/fit/time_filters.h"
#include "solver/handover/state_path.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kNumStates = 4;            // a state is the bits of the hands that hold
constexpr double kEvidenceRate = 30.0;   // costs are per 1 / this seconds
constexpr double kSmoothing_s = 0.05;    // standard deviation of the Gaussian over time
constexpr double kSlopeWindow_s = 0.10;  // to either side, for speeds
constexpr double kHeldWindow_s = 0.5;    // to either side, for where a hand holds the object
constexpr int kTouchingVertices = 8;     // as many as a fingertip has
constexpr double kMostAgainst = 12.0;    // nats of one frame's evidence
constexpr double kMostFor = 3.0;
constexpr double kAway = 100.0;  // metres

// What one hand sees of the object, one column or entry per frame.
struct HandView {
  Eigen::VectorXd gap;         // metres, 0 where skin touches or is inside
  Eigen::Matrix3Xd wrist;      // world
  Eigen::Matrix3Xd center;     // of the object, in the wrist's frame
  std::vector<Matrix3d> turn;  // wrist from object
};

HandView View(const Clip& clip, const HandModel& hand, const DistanceGrid& object, int threads) {
  const int frames = clip.NumFrames();
  const Vector3d middle = 0.5 * (object.Min() + object.Max());
  HandView view{Eigen::VectorXd(frames), Eigen::Matrix3Xd(3, frames), Eigen::Matrix3Xd(3, frames),
                std::vector<Matrix3d>(static_cast<std::size_t>(frames))};
  constexpr int kBlock = 16;  // frames that share a scratch hand
  ParallelFor((frames + kBlock - 1) / kBlock, threads, [&](int block) {
    HandState state(hand);
    for (int t = kBlock * block; t < std::min(frames, kBlock * (block + 1)); ++t) {
      state.SetBody(clip.pose[t], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[t], hand.HandSide()), false);
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
      if (nearest == 0) {  // the model lacks this hand: it is nowhere near
        view.gap(t) = kAway;
        continue;
      }
      std::partial_sort(distance.begin(), distance.begin() + nearest, distance.end());
      double sum = 0.0;
      for (int i = 0; i < nearest; ++i) sum += distance[i];
      view.gap(t) = sum / nearest;
    }
  });
  return view;
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

// How far the object is, in each frame, from where this hand holds it in the nearest frames that it
// is held in; infinite where there are none within the window.
Eigen::VectorXd DistanceFromHeld(const Eigen::Matrix3Xd& center, const std::vector<bool>& held,
                                 Eigen::Index reach) {
  const Eigen::Index frames = center.cols();
  Eigen::VectorXd distance(frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    // The nearest frame of a hold, and the stretch of that hold around it.
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

}  // namespace

Holding FindHolding(const Clip& clip, const HandModel& right, const HandModel& left,
                    const DistanceGrid& object, const HoldingOptions& options) {
  if (!clip.object) {
    throw Error("clip", "has no object trajectory to tell who holds it", "Fit the object first.");
  }
  if (right.HandSide() != Side::kRight || left.HandSide() != Side::kLeft) {
    throw Error("hands", "are not a right and a left one", "Give one of each.");
  }
  const Eigen::Index frames = clip.NumFrames();
  const double fps = clip.frame_rate;
  const double sigma_frames = std::max(0.3, kSmoothing_s * fps);
  const auto window = [&](double seconds) {
    return std::max<Eigen::Index>(1, std::lround(seconds * fps));
  };
  const Eigen::Index slope_reach = window(kSlopeWindow_s);
  // What is left of one frame's noise after smoothing, and in a slope.
  const double smoothed = NoiseAfterSmoothing(sigma_frames);
  const double slope_noise = fps * NoiseOfSlope(slope_reach);
  const double radius = 0.25 * (object.Max() - object.Min()).norm();  // of its turning surface

  const auto speed_from = [&](const Eigen::Matrix3Xd& slopes) -> Eigen::VectorXd {
    return fps * slopes.colwise().norm();
  };
  const Vector3d middle = 0.5 * (object.Min() + object.Max());
  Eigen::Matrix3Xd in_world(3, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    in_world.col(t) = ExpSO3(clip.object->orient.col(t)) * middle + clip.object->trans.col(t);
  }
  const double world_noise = WhiteNoise(in_world);
  const Eigen::VectorXd world_speed = speed_from(SlopesOverTime(in_world, slope_reach));

  // Log-odds that each hand holds.
  std::array<HandView, 2> views = {View(clip, right, object, options.threads),
                                   View(clip, left, object, options.threads)};
  std::array<Eigen::VectorXd, 2> contact, motion;
  std::array<double, 2> noise{};
  std::array<Eigen::Matrix3Xd, 2> center;
  for (int h = 0; h < 2; ++h) {
    const HandView& view = views[h];
    noise[h] = WhiteNoise(view.center);
    center[h] = SmoothOverTime(view.center, sigma_frames);
    const Eigen::VectorXd gap = SmoothOverTime(view.gap.transpose(), sigma_frames).transpose();
    const double touching = options.contact_m + noise[h] * smoothed;
    const double scale = options.contact_scale_m + noise[h] * smoothed;
    contact[h] = ((touching - gap.array()) / scale).cwiseMin(kMostFor).cwiseMax(-kMostAgainst);

    const Eigen::VectorXd moves = speed_from(SlopesOverTime(view.center, slope_reach));
    const Eigen::VectorXd turns =
        speed_from(SlopesOverTime(frames, slope_reach, [&](Eigen::Index t, Eigen::Index u) {
          return Vector3d(radius * LogSO3(view.turn[t].transpose() * view.turn[u]));
        }));
    const Eigen::VectorXd wrist_speed = speed_from(SlopesOverTime(view.wrist, slope_reach));
    const double still = options.still_m_s + 2.5 * noise[h] * slope_noise;
    motion[h].resize(frames);
    for (Eigen::Index t = 0; t < frames; ++t) {
      const double relative = std::max(moves(t), turns(t) - still);
      // Standing still together says nothing: what the hand's own movement would show counts.
      const double telling = std::min(1.0, wrist_speed(t) / (3.0 * still));
      motion[h](t) = relative < still ? 2.0 * telling * (1.0 - relative / still)
                                      : std::max(-8.0, -4.0 * (relative / still - 1.0));
    }
  }
  const double world_still = options.still_m_s + 2.5 * world_noise * slope_noise;

  const double rate = kEvidenceRate / fps;
  Eigen::Matrix4d change;
  for (int a = 0; a < kNumStates; ++a) {
    for (int b = 0; b < kNumStates; ++b) {
      change(a, b) = options.change_cost * ((a ^ b) == 0 ? 0 : (a ^ b) == 3 ? 2 : 1);
    }
  }
  const auto decide = [&](const std::array<Eigen::VectorXd, 2>& odds) {
    Eigen::MatrixXd costs(kNumStates, frames);
    for (Eigen::Index t = 0; t < frames; ++t) {
      // Nobody carries what moves.
      const double flying = std::clamp(4.0 * (world_speed(t) / world_still - 1.0), 0.0, 8.0);
      for (int state = 0; state < kNumStates; ++state) {
        double cost = state == 0 ? flying : 0.0;
        for (int h = 0; h < 2; ++h) cost += 0.5 * ((state >> h & 1) != 0 ? -1.0 : 1.0) * odds[h](t);
        costs(state, t) = rate * cost;
      }
    }
    return FindStatePath(costs, change);
  };
  StatePath path = decide({contact[0] + motion[0], contact[1] + motion[1]});

  // Now that it is known about when each hand holds, where it does is known, too: a hand that is
  // somewhere else relative to the object has not taken it yet, or has let go.
  constexpr double kSlack = 0.012;  // what an object may shift in a hand, metres
  std::array<Eigen::VectorXd, 2> odds;
  for (int h = 0; h < 2; ++h) {
    std::vector<bool> held(static_cast<std::size_t>(frames));
    for (Eigen::Index t = 0; t < frames; ++t) held[t] = (path.states[t] >> h & 1) != 0;
    const Eigen::VectorXd away = DistanceFromHeld(center[h], held, window(kHeldWindow_s));
    const double allowed = kSlack + 2.5 * noise[h] * smoothed;
    odds[h] = contact[h] + motion[h];
    for (Eigen::Index t = 0; t < frames; ++t) {
      if (!std::isfinite(away(t))) continue;
      const double ratio = away(t) / allowed;
      odds[h](t) += std::max(-kMostAgainst, 1.5 * (1.0 - ratio * ratio));
    }
  }
  path = decide(odds);

  Holding holding;
  for (Eigen::Index t = 0; t < frames; ++t) {
    holding.hands.push_back(static_cast<std::uint8_t>(path.states[t]));
    holding.confidence.push_back(path.posterior(path.states[t], t));
  }
  holding.switches = SwitchesOf(holding.hands);
  for (HandSwitch& change_of_hands : holding.switches) {
    // As sure as the frames around it are.
    const Eigen::Index begin = std::max<Eigen::Index>(0, change_of_hands.frame - window(0.25));
    const Eigen::Index end = std::min(frames, change_of_hands.frame + window(0.25) + 1);
    double sum = 0.0;
    for (Eigen::Index t = begin; t < end; ++t) sum += holding.confidence[t];
    change_of_hands.confidence = sum / static_cast<double>(end - begin);
  }
  return holding;
}

std::vector<HandSwitch> SwitchesOf(const std::vector<std::uint8_t>& hands) {
  std::vector<HandSwitch> switches;
  int last = 0;        // the hand that held alone, last
  int last_frame = 0;  // and until when
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
