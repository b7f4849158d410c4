// SPDX-License-Identifier: MIT
#include "solver/handover/handover_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/finger_repair.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {
namespace {

constexpr double kAround_s = 0.30;  // of the motions before and after
constexpr double kShift_s = 0.30;   // maximum shift of either end from the guess
constexpr std::array<double, 4> kDurations_s = {0.45, 0.6, 0.8, 1.1};

}  // namespace

Dwell FitDwell(const Eigen::Matrix3Xd& between, double frame_rate, const Dwell& guess) {
  const auto frames = static_cast<int>(between.cols());
  const int around = static_cast<int>(std::lround(kAround_s * frame_rate));
  const int first = std::max(0, static_cast<int>(std::floor(guess.begin)) - around);
  const int last = std::min(frames - 1, static_cast<int>(std::ceil(guess.end)) + around);
  const int count = last - first + 1;
  if (count < 8) return guess;
  const Eigen::MatrixX3d seen = between.middleCols(first, count).transpose();
  const double seen_squared = seen.squaredNorm();
  const int steps = static_cast<int>(std::lround(2.0 * kShift_s * frame_rate));

  // Columns of the two motions for every end and duration; all sums are over the window.
  struct Column {
    double at;
    Eigen::VectorXd values;
    double sum, squared;
    Eigen::RowVector3d with_seen;
  };
  const auto columns = [&](double from, int sign) {
    std::vector<Column> all;
    for (int s = -steps; s <= steps; ++s) {
      const double at = from + 0.5 * s;
      if (at < first || at > last) continue;
      for (const double duration : kDurations_s) {
        Column column{at, Eigen::VectorXd(count), 0.0, 0.0, {}};
        for (int i = 0; i < count; ++i) {
          column.values(i) = MinimumJerk(sign * (first + i - at) / (frame_rate * duration));
        }
        column.sum = column.values.sum();
        column.squared = column.values.squaredNorm();
        column.with_seen = column.values.transpose() * seen;
        all.push_back(std::move(column));
      }
    }
    return all;
  };
  const std::vector<Column> before = columns(guess.begin, -1), after = columns(guess.end, 1);
  const Eigen::RowVector3d seen_sum = seen.colwise().sum();

  Dwell best = guess;
  double least = std::numeric_limits<double>::infinity();
  for (const Column& a : before) {
    for (const Column& b : after) {
      if (b.at < a.at) continue;
      const double ab = a.values.dot(b.values);
      // Small damping: a motion that is not observed should not be fitted.
      constexpr double kSmall = 1e-6;
      Eigen::Matrix3d normal;
      normal << count, a.sum, b.sum, a.sum, a.squared + kSmall, ab, b.sum, ab, b.squared + kSmall;
      Eigen::Matrix3d right;
      right << seen_sum, a.with_seen, b.with_seen;
      const Eigen::Matrix3d solved = normal.ldlt().solve(right);
      const double residual = seen_squared - (solved.array() * right.array()).sum();
      if (residual < least) {
        least = residual;
        best = {a.at, b.at};
      }
    }
  }
  return best;
}

int DwellMiddle(const Eigen::Matrix3Xd& between, double frame_rate, const HandSwitch& change) {
  const Dwell dwell =
      FitDwell(between, frame_rate, {1.0 * change.both_begin, change.both_end - 1.0});
  const auto last = static_cast<int>(between.cols()) - 1;
  return std::clamp(static_cast<int>(std::lround(dwell.Middle())), 1, last);
}

namespace {

// -log sum exp(-x), for costs that may be infinite.
double SoftMinimum(const Eigen::VectorXd& x) {
  const double least = x.minCoeff();
  if (!std::isfinite(least)) return least;
  return least - std::log((least - x.array()).exp().sum());
}

}  // namespace

StatePath ViterbiPath(const Eigen::MatrixXd& costs, const Eigen::MatrixXd& change) {
  const Eigen::Index steps = costs.cols();
  StatePath path;
  path.posterior.resize(costs.rows(), steps);
  if (steps == 0) return path;

  Eigen::MatrixXi from(costs.rows(), steps);
  Eigen::MatrixXd forward(costs.rows(), steps);
  Eigen::VectorXd best = costs.col(0);
  forward.col(0) = costs.col(0);
  for (Eigen::Index t = 1; t < steps; ++t) {
    Eigen::VectorXd next(costs.rows());
    for (Eigen::Index s = 0; s < costs.rows(); ++s) {
      Eigen::Index least;
      next(s) = costs(s, t) + (best + change.col(s)).minCoeff(&least);
      from(s, t) = static_cast<int>(least);
      forward(s, t) = costs(s, t) + SoftMinimum(forward.col(t - 1) + change.col(s));
    }
    best = next;
  }
  Eigen::Index state;
  path.cost = best.minCoeff(&state);
  path.states.resize(static_cast<std::size_t>(steps));
  for (Eigen::Index t = steps - 1; t >= 0; --t) {
    path.states[t] = static_cast<int>(state);
    if (t > 0) state = from(state, t);
  }

  Eigen::VectorXd backward = Eigen::VectorXd::Zero(costs.rows());
  for (Eigen::Index t = steps - 1; t >= 0; --t) {
    const Eigen::VectorXd total = forward.col(t) + backward;
    path.posterior.col(t) = (SoftMinimum(total) - total.array()).exp();
    if (t == 0) break;
    const Eigen::VectorXd behind = costs.col(t) + backward;
    for (Eigen::Index s = 0; s < costs.rows(); ++s) {
      backward(s) = SoftMinimum(change.row(s).transpose() + behind);
    }
  }
  return path;
}

namespace {

using Eigen::Vector3d;

constexpr double kSignalSmoothing_s = 0.06;
constexpr double kSignalSlope_s = 0.12;
constexpr double kActivityWindow_s = 0.35;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Motion of both hands, per frame.
struct HandsInTime {
  Eigen::Matrix3Xd raw_between;    // unfiltered `between`
  Eigen::Matrix3Xd between;        // left to right holding point, meters, chest frame
  Eigen::VectorXd apart;           // distance of the holding points of the palms, meters
  Eigen::VectorXd relative_speed;  // m/s
  double speed_noise_m_s = 0.0;
  double noise_m = 0.0;                     // remaining in `apart`
  std::array<Eigen::VectorXd, 2> activity;  // 0: hanging still .. about 1: raised and active
};

// Point where a hand holds objects: in front of the center of the palm, wrist frame.
Vector3d HoldingPlace(const HandModel& hand, double object_size_m) {
  const HandAxes axes(hand);
  const double before = 0.015 + 0.5 * std::min(object_size_m, 0.08);
  return 0.85 * axes.RestJoints().col(3 * kMiddle) + before * axes.PalmNormal();
}

HandsInTime Observe(const Clip& clip, const HandModel& right, const HandModel& left,
                    double object_size_m) {
  const Eigen::Index frames = clip.NumFrames();
  const double fps = clip.frame_rate;
  const std::array<const HandModel*, 2> hands = {&right, &left};
  const std::array<Vector3d, 2> place = {HoldingPlace(right, object_size_m),
                                         HoldingPlace(left, object_size_m)};
  Eigen::Matrix3Xd between(3, frames);  // in the chest frame, which does not sway
  std::array<Eigen::Matrix3Xd, 2> in_chest = {Eigen::Matrix3Xd(3, frames),
                                              Eigen::Matrix3Xd(3, frames)};
  std::array<Eigen::VectorXd, 2> height = {Eigen::VectorXd(frames), Eigen::VectorXd(frames)};
  BodyState state;
  for (Eigen::Index t = 0; t < frames; ++t) {
    ForwardJoints(right.Surface().RestJoints(), clip.pose[t], clip.trans.col(t), state);
    const Eigen::Matrix3d chest_from_world = state.world_rotation[kSpine3].transpose();
    std::array<Vector3d, 2> held;
    for (int h = 0; h < 2; ++h) {
      const int wrist = WristJoint(hands[h]->HandSide());
      held[h] = state.joints.col(wrist) + state.world_rotation[wrist] * place[h];
      in_chest[h].col(t) = chest_from_world * (state.joints.col(wrist) - state.joints.col(kSpine3));
      height[h](t) = state.joints(2, wrist) - state.joints(2, kPelvis);
    }
    between.col(t) = chest_from_world * (held[0] - held[1]);
  }

  HandsInTime seen;
  const double sigma = std::max(0.3, kSignalSmoothing_s * fps);
  const auto reach = std::max<Eigen::Index>(1, std::lround(kSignalSlope_s * fps));
  seen.speed_noise_m_s = WhiteNoise(between) * fps * NoiseOfSlope(reach);
  seen.noise_m = WhiteNoise(between) * NoiseAfterSmoothing(sigma);
  seen.between = GaussianFilter(between, sigma);
  seen.raw_between = between;
  seen.apart = seen.between.colwise().norm();
  seen.relative_speed = fps * SlopesOverTime(between, reach).colwise().norm().transpose();
  for (int h = 0; h < 2; ++h) {
    const Eigen::VectorXd speed =
        fps * SlopesOverTime(in_chest[h], reach).colwise().norm().transpose();
    // A wrist at hip height hangs; 30 cm higher, the forearm is raised.
    const Eigen::VectorXd raised = (height[h].array() / 0.3).cwiseMax(0.0).cwiseMin(1.0);
    const Eigen::VectorXd busy = raised.array() + (speed.array() / 0.5).cwiseMin(1.0);
    seen.activity[h] =
        GaussianFilter(busy.transpose(), std::max(0.3, kActivityWindow_s * fps)).transpose();
  }
  return seen;
}

// An interval in which the hands are together and could pass an object.
struct Meeting {
  int begin = 0, end = 0;  // together in [begin, end)
  double cost = 0.0;       // nats, of a handover here
  int Frame() const { return static_cast<int>(std::lround(0.5 * (begin + end - 1))); }
};

// The longest interval around a frame in which the displacement between the hands is constant, as
// when both hold one object. Searched in frames [begin, end).
Meeting LongestHold(const Eigen::Matrix3Xd& between, int begin, int end, double margin_m) {
  Meeting longest{begin, begin + 1, 0.0};
  for (int t = begin; t < end; ++t) {
    Meeting hold{t, t + 1, 0.0};
    const auto same = [&](int u) {
      return u >= begin && u < end && (between.col(u) - between.col(t)).norm() < margin_m;
    };
    while (same(hold.begin - 1)) --hold.begin;
    while (same(hold.end)) ++hold.end;
    if (hold.end - hold.begin > longest.end - longest.begin) longest = hold;
  }
  return longest;
}

// Between the minima of the hands' distance it rises by `parting_m`; around each minimum, within
// that rise, there is one interval in which the hands are still relative to each other.
std::vector<Meeting> FindMeetings(const HandsInTime& seen, double parting_m, double margin_m) {
  const Eigen::VectorXd& apart = seen.apart;
  const int frames = static_cast<int>(apart.size());
  std::vector<Meeting> meetings;
  const auto add = [&](int nearest) {
    const double near = apart(nearest) + parting_m;
    int begin = nearest, end = nearest + 1;
    while (begin > 0 && apart(begin - 1) < near) --begin;
    while (end < frames && apart(end) < near) ++end;
    meetings.push_back(LongestHold(seen.between, begin, end, margin_m));
  };
  int nearest = 0, farthest = 0;
  bool approaching = true;
  for (int t = 1; t < frames; ++t) {
    if (approaching) {
      if (apart(t) < apart(nearest)) nearest = t;
      if (apart(t) > apart(nearest) + parting_m) {
        add(nearest);
        approaching = false;
        farthest = t;
      }
    } else {
      if (apart(t) > apart(farthest)) farthest = t;
      if (apart(t) < apart(farthest) - parting_m) {
        approaching = true;
        nearest = t;
      }
    }
  }
  if (approaching) add(nearest);
  return meetings;
}

// A hypothesis for a clip: who has the object first, and at which meetings it switches.
struct Account {
  double cost = kInfinity;
  int first = 0;  // 0 right, 1 left
  std::vector<std::size_t> meetings;
};

// Returns the hypothesis with the lowest cost and min..max switches. `had(h, t)`: nats for hand h
// to have the object in all frames before t.
Account Explain(const std::vector<Meeting>& meetings, const Eigen::Matrix2Xd& had,
                const HandoverSearchOptions& options) {
  const auto last = static_cast<int>(had.cols()) - 1;
  const auto count = static_cast<int>(meetings.size());
  const int most = std::min(options.max_switches, count);
  Account best;
  for (int first = 0; first < 2; ++first) {
    if (options.first_hand && (*options.first_hand == Side::kRight) != (first == 0)) continue;
    // cost(k, m): of the frames before meeting m as the k-th switch.
    Eigen::MatrixXd cost = Eigen::MatrixXd::Constant(most + 1, count, kInfinity);
    Eigen::MatrixXi before = Eigen::MatrixXi::Constant(most + 1, count, -1);
    const auto between = [&](int k, int from, int to) {  // after switch k, between two frames
      const int hand = (first + k) % 2;
      return had(hand, to) - had(hand, from);
    };
    for (int m = 0; m < count; ++m) {
      for (int k = 1; k <= most; ++k) {
        if (k == 1) cost(k, m) = between(0, 0, meetings[m].Frame());
        for (int p = 0; p < m && k > 1; ++p) {
          const double through =
              cost(k - 1, p) + between(k - 1, meetings[p].Frame(), meetings[m].Frame());
          if (through < cost(k, m)) {
            cost(k, m) = through;
            before(k, m) = p;
          }
        }
        cost(k, m) += meetings[m].cost;
      }
    }
    for (int k = options.min_switches; k <= most; ++k) {
      if (k == 0 && between(0, 0, last) < best.cost) best = {between(0, 0, last), first, {}};
      for (int m = 0; m < count && k > 0; ++m) {
        const double total = cost(k, m) + between(k, meetings[m].Frame(), last);
        if (!(total < best.cost)) continue;
        best = {total, first, {}};
        for (int j = k, at = m; j > 0; at = before(j, at), --j) {
          best.meetings.insert(best.meetings.begin(), static_cast<std::size_t>(at));
        }
      }
    }
  }
  return best;
}

void CheckOptions(const HandoverSearchOptions& options, int frames) {
  if (frames < 2)
    throw Error("clip", "has fewer than two frames", "Give a clip of at least two frames");
  if (options.min_switches < 0 || options.max_switches < options.min_switches) {
    throw Error("switches",
                fmt::format("have an invalid range: {} at least and {} at most",
                            options.min_switches, options.max_switches),
                "Give a minimum of 0 or more and a maximum that is not below it");
  }
  int before = 0;
  for (const int frame : options.switch_frames) {
    if (frame <= before || frame >= frames) {
      throw Error("--switch", fmt::format("frame {} is out of order or out of range", frame),
                  fmt::format("Give ascending frames from 1 to {}", frames - 1));
    }
    before = frame;
  }
}

// Sets the holding hands per frame, for ordered switches with both hands in [both_begin, both_end).
void FillHands(Side first, int frames, HoldLabels& holding) {
  holding.hands.assign(static_cast<std::size_t>(frames), HoldingBit(first));
  for (const HandSwitch& change : holding.switches) {
    for (int t = change.both_begin; t < frames; ++t) {
      holding.hands[t] = t < change.both_end ? kHoldsRight | kHoldsLeft : HoldingBit(change.to);
    }
  }
}

// `had` of Explain: the more active hand has the object.
Eigen::Matrix2Xd CostsOfHaving(const HandsInTime& seen, double activity_weight, double rate) {
  const Eigen::Index frames = seen.apart.size();
  Eigen::Matrix2Xd had = Eigen::Matrix2Xd::Zero(2, frames + 1);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const double sum = seen.activity[0](t) + seen.activity[1](t) + 0.1;
    const double more = (seen.activity[0](t) - seen.activity[1](t)) / sum;
    had(0, t + 1) = had(0, t) + 0.5 * activity_weight * rate * (1.0 - more);
    had(1, t + 1) = had(1, t) + 0.5 * activity_weight * rate * (1.0 + more);
  }
  return had;
}

// Meetings at the given switch frames.
std::vector<Meeting> GivenMeetings(const HandoverSearchOptions& options, double frame_rate,
                                   int frames) {
  std::vector<Meeting> meetings;
  const int half = static_cast<int>(std::lround(0.5 * options.dwell_s * frame_rate));
  for (const int frame : options.switch_frames) {
    meetings.push_back({std::max(1, frame - half), std::min(frames, frame + half + 1), 0.0});
  }
  // Adjacent meetings split the frames between them.
  for (std::size_t m = 1; m < meetings.size(); ++m) {
    const int middle = (options.switch_frames[m - 1] + options.switch_frames[m] + 1) / 2;
    meetings[m - 1].end = std::min(meetings[m - 1].end, middle);
    meetings[m].begin = std::max(meetings[m].begin, middle);
  }
  return meetings;
}

// Hypothesis with switches at all given meetings.
Account ExplainGiven(const std::vector<Meeting>& meetings, const Eigen::Matrix2Xd& had,
                     const HandoverSearchOptions& options) {
  Account account;
  for (std::size_t m = 0; m < meetings.size(); ++m) account.meetings.push_back(m);
  HandoverSearchOptions exactly = options;
  exactly.min_switches = exactly.max_switches = static_cast<int>(meetings.size());
  account.first = Explain(meetings, had, exactly).first;
  return account;
}

// Meetings at which the hands are near enough to pass the object, with the cost of a handover.
std::vector<Meeting> MeetingsWithinReach(const HandsInTime& seen, double object_size_m,
                                         const HandoverSearchOptions& options) {
  constexpr double kParting = 0.06;   // meters
  constexpr double kSettled = 0.020;  // meters within which hands are together
  constexpr double kSlow = 0.15;      // m/s, per nat
  constexpr double kFarther = 0.06;   // meters, per nat
  std::vector<Meeting> meetings;
  const double margin = kSettled + 2.0 * seen.noise_m;
  for (Meeting& meeting : FindMeetings(seen, kParting + margin, margin)) {
    const int frame = meeting.Frame();
    if (frame < 1 || seen.apart(frame) > object_size_m + options.reach_m) continue;
    meeting.cost = options.switch_cost +
                   std::max(0.0, seen.apart(frame) - 0.5 * object_size_m - 0.05) / kFarther +
                   std::max(0.0, seen.relative_speed(frame) - 2.0 * seen.speed_noise_m_s) / kSlow;
    meetings.push_back(meeting);
  }
  if (static_cast<int>(meetings.size()) < options.min_switches) {
    throw Error("clip",
                fmt::format("the hands come together {} times, nearest {:.0f} cm apart",
                            meetings.size(), 100.0 * seen.apart.minCoeff()),
                "Give the frames where the object changes hands with --switch FRAME[,FRAME...]");
  }
  return meetings;
}

// Probability of a switch of `best`, relative to the best hypothesis without its meeting.
double ConfidenceInMeeting(std::size_t switched, const Account& best,
                           const std::vector<Meeting>& meetings, const Eigen::Matrix2Xd& had,
                           const HandoverSearchOptions& options) {
  std::vector<Meeting> without = meetings;
  without.erase(without.begin() + static_cast<std::ptrdiff_t>(switched));
  HandoverSearchOptions free = options;
  free.min_switches = 0;
  const double other = Explain(without, had, free).cost;
  return 1.0 / (1.0 + std::exp(best.cost - other));
}

// Between two switches, the lower of their confidences.
void FillConfidence(int frames, HoldLabels& holding) {
  holding.confidence.assign(static_cast<std::size_t>(frames), 1.0);
  for (int t = 0; t < frames; ++t) {
    for (std::size_t k = 0; k < holding.switches.size(); ++k) {
      const bool before = t < holding.switches[k].frame;
      const bool after_last = k == 0 || t >= holding.switches[k - 1].frame;
      const bool before_next =
          k + 1 == holding.switches.size() || t < holding.switches[k + 1].frame;
      if ((before && after_last) || (!before && before_next)) {
        holding.confidence[t] = std::min(holding.confidence[t], holding.switches[k].confidence);
      }
    }
  }
}

}  // namespace

HoldLabels FindHandovers(const Clip& clip, const HandModel& right, const HandModel& left,
                         double object_size_m, const HandoverSearchOptions& options) {
  const int frames = clip.NumFrames();
  CheckOptions(options, frames);
  const HandsInTime seen = Observe(clip, right, left, object_size_m);
  const double rate = 1.0 / clip.frame_rate;
  const Eigen::Matrix2Xd had = CostsOfHaving(seen, options.activity_weight, rate);
  const bool given = !options.switch_frames.empty();
  const std::vector<Meeting> meetings = given ? GivenMeetings(options, clip.frame_rate, frames)
                                              : MeetingsWithinReach(seen, object_size_m, options);
  const Account best =
      given ? ExplainGiven(meetings, had, options) : Explain(meetings, had, options);

  HoldLabels holding;
  const Side first = best.first == 0 ? Side::kRight : Side::kLeft;
  Side holder = first;
  for (std::size_t k = 0; k < best.meetings.size(); ++k) {
    const Meeting& meeting = meetings[best.meetings[k]];
    HandSwitch change;
    change.from = holder;
    change.to = holder = OtherSide(holder);
    change.both_begin = meeting.begin;
    change.both_end = meeting.end;
    change.frame =
        given ? options.switch_frames[k] : DwellMiddle(seen.raw_between, clip.frame_rate, change);
    change.confidence =
        given ? 1.0 : ConfidenceInMeeting(best.meetings[k], best, meetings, had, options);
    holding.switches.push_back(change);
  }
  FillHands(first, frames, holding);
  // Given switches have confidence 1, and so have all frames then.
  FillConfidence(frames, holding);
  return holding;
}

}  // namespace holdfast
