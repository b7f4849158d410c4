// SPDX-License-Identifier: MIT
#include "generator/matching/foot_lock.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "generator/body/limb_ik.h"
#include "generator/scripted/minimum_jerk.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr int kFadeIn = 10;  // frames

struct Stance {
  int begin, end;  // frames [begin, end)
};

std::vector<Stance> StancesOf(const std::vector<SoleBits>& contacts, SoleBits mask) {
  std::vector<Stance> stances;
  for (int t = 0; t < static_cast<int>(contacts.size()); ++t) {
    if ((contacts[t] & mask) == 0) continue;
    if (stances.empty() || stances.back().end != t) stances.push_back({t, t});
    stances.back().end = t + 1;
  }
  return stances;
}

// Horizontal displacement of a planted foot from frame t - 1 to t: of its ball, or of its heel
// while the ball is in the air. `heel` is the first of the foot's two columns.
Eigen::Vector2d Drift(const std::vector<Soles>& soles, const std::vector<SoleBits>& contacts,
                      int heel, int t) {
  const int point = (contacts[t] & (2u << heel)) != 0 ? heel + 1 : heel;
  return (soles[t].col(point) - soles[t - 1].col(point)).head<2>();
}

// Lifts a foot that drifts far while in contact, as in transitions between two stances: such frames
// lose their contact if the other foot is in contact. Returns the lift of the foot in every frame.
std::vector<double> StepWhereDrifting(const std::vector<Soles>& soles, int heel,
                                      std::vector<SoleBits>& contacts) {
  constexpr double kFarthest = 0.05;  // meters
  constexpr int kBefore = 4, kAfter = 8;
  constexpr double kLift = 0.04;
  const int frames = static_cast<int>(soles.size());
  const auto foot = static_cast<SoleBits>(3u << heel);
  const auto other = static_cast<SoleBits>(3u << (2 - heel));
  std::vector<double> lift(soles.size(), 0.0);
  Eigen::Vector2d drift = Eigen::Vector2d::Zero();
  for (int t = 1; t < frames; ++t) {
    const bool planted = (contacts[t] & foot) != 0 && (contacts[t - 1] & foot) != 0;
    drift = planted ? Eigen::Vector2d(drift + Drift(soles, contacts, heel, t))
                    : Eigen::Vector2d::Zero();
    if (drift.norm() < kFarthest || t < kBefore || t + kAfter >= frames) continue;
    bool carried = true;
    for (int s = t - kBefore; s < t + kAfter; ++s) {
      carried = carried && (contacts[s] & other) != 0;
    }
    if (!carried) continue;
    for (int s = t - kBefore; s < t + kAfter; ++s) {
      contacts[s] = static_cast<SoleBits>(contacts[s] & ~foot);
      lift[s] = kLift * MinimumJerk(2.0 * std::min(s - t + kBefore + 1, t + kAfter - s) /
                                    (kBefore + kAfter + 1.0));
    }
    t += kAfter;
    drift.setZero();
  }
  return lift;
}

// Displacement of the foot in every frame.
std::vector<Vector3d> Corrections(const std::vector<Soles>& soles,
                                  const std::vector<SoleBits>& contacts, int heel,
                                  const FootLockOptions& options) {
  const int frames = static_cast<int>(soles.size());
  const std::vector<Stance> stances = StancesOf(contacts, static_cast<SoleBits>(3u << heel));
  std::vector<Vector3d> correction(soles.size(), Vector3d::Zero());
  const auto lowest = [&](int t) { return std::min(soles[t](2, heel), soles[t](2, heel + 1)); };
  for (const Stance& stance : stances) {
    Vector3d mean = Vector3d::Zero();
    for (int t = stance.begin; t < stance.end; ++t) {
      if (t > stance.begin) {
        correction[t].head<2>() = correction[t - 1].head<2>() - Drift(soles, contacts, heel, t);
      }
      mean += correction[t];
    }
    mean /= stance.end - stance.begin;
    if (options.keep_first && stance.begin == 0) mean.setZero();
    for (int t = stance.begin; t < stance.end; ++t) {
      correction[t] -= mean;
      correction[t].z() = -lowest(t);
    }
  }
  // Frames in the air, before the first stance and after the last.
  int previous = -1;
  for (std::size_t k = 0; k <= stances.size(); ++k) {
    const int next = k < stances.size() ? stances[k].begin : frames;
    // A kept first frame is the start of the path to the first stance.
    const int begin = previous < 0 && options.keep_first ? 0 : previous;
    for (int t = previous + 1; t < next; ++t) {
      Vector3d from = Vector3d::Zero();
      if (previous >= 0) {
        from = correction[previous];
      } else if (next < frames && !options.keep_first) {
        from = correction[next];
      }
      const Vector3d to = next < frames ? correction[next] : from;
      const double x = static_cast<double>(t - begin) / (next - begin);
      correction[t] = from + MinimumJerk(x) * (to - from);
      const bool steps = previous >= 0 && next < frames;
      const double height = steps ? options.clearance_m * std::min(1.0, 6.0 * x * (1.0 - x)) : 0.0;
      correction[t].z() = std::max(correction[t].z(), height - lowest(t));
    }
    if (k < stances.size()) previous = stances[k].end - 1;
  }
  // Heights jump where a contact begins or ends a frame early, so they are smoothed over time.
  std::vector<Vector3d> smooth = correction;
  for (int t = 0; t < frames; ++t) {
    const auto z = [&](int s) { return correction[std::clamp(s, 0, frames - 1)].z(); };
    smooth[t].z() = 0.375 * z(t) + 0.25 * (z(t - 1) + z(t + 1)) + 0.0625 * (z(t - 2) + z(t + 2));
  }
  if (options.keep_first) {
    for (int t = 0; t < std::min(kFadeIn, frames); ++t) smooth[t].z() *= FadeIn(t);
  }
  return smooth;
}

}  // namespace

double FadeIn(int frame) { return MinimumJerk(static_cast<double>(frame) / kFadeIn); }

std::vector<FeetTarget> LockFeet(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
                                 const std::vector<SoleBits>& contacts,
                                 std::vector<BodyFrame>& frames, const FootLockOptions& options,
                                 FootLockReport* report) {
  const std::size_t count = frames.size();
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  const std::vector<Soles> points = soles.At(placed);
  std::vector<FeetTarget> feet = FeetOf(placed);
  FootLockReport found;
  std::vector<SoleBits> planted = contacts;
  std::array<std::vector<double>, 2> lift;
  for (const int side : {0, 1}) {
    lift[static_cast<std::size_t>(side)] = StepWhereDrifting(points, 2 * side, planted);
  }
  for (const int side : {0, 1}) {
    const std::vector<Vector3d> correction = Corrections(points, planted, 2 * side, options);
    const SoleBits mask = side == 0 ? kLeftSole : kRightSole;
    for (std::size_t t = 0; t < count; ++t) {
      Vector3d& ankle = feet[t].ankle[static_cast<std::size_t>(side)];
      ankle += correction[t];
      ankle.z() += lift[static_cast<std::size_t>(side)][t];
      if ((planted[t] & mask) != 0) {
        found.max_correction_m = std::max(found.max_correction_m, correction[t].head<2>().norm());
      }
    }
  }
  std::vector<double> sink = PelvisSink(rest_joints, frames, feet);
  for (std::size_t t = 0; t < count; ++t) {
    const double share = options.keep_first ? FadeIn(static_cast<int>(t)) : 1.0;
    const BodyFrame before = frames[t];
    sink[t] = share * std::min(sink[t], options.most_sink_m);
    frames[t].pelvis.z() -= sink[t];
    const double drawn = DrawIntoReach(rest_joints, frames[t], feet[t]);
    found.max_sink_m = std::max(found.max_sink_m, sink[t]);
    found.max_missed_m =
        std::max({found.max_missed_m, drawn, PlaceLegs(rest_joints, feet[t], frames[t])});
    if (share == 1.0) continue;
    // Even for feet at their original positions, the IK may change the legs (knees may turn out).
    for (const Side side : {Side::kLeft, Side::kRight}) {
      const Limb leg = Leg(side);
      for (const int joint : {leg.root, leg.middle, leg.end}) {
        frames[t].local[joint] = before.local[joint].slerp(share, frames[t].local[joint]);
      }
    }
  }
  if (report != nullptr) *report = found;
  return feet;
}

namespace {

constexpr std::array<int, GroundProbe::kNumSoles> kSoleJoints = {7, 10, 8, 11};
constexpr double kContactHeight = 0.04;  // meters
constexpr double kContactSpeed = 0.35;   // m/s; allows a sole that rolls over the ball
constexpr double kShortestRun = 0.1;     // seconds

// Flips runs of `value` that are shorter than `shortest` and lie between runs of the other value.
void FlipShortRuns(std::vector<bool>& flags, bool value, std::size_t shortest) {
  for (std::size_t begin = 0; begin < flags.size();) {
    std::size_t end = begin;
    while (end < flags.size() && flags[end] == flags[begin]) ++end;
    if (flags[begin] == value && end - begin < shortest && begin > 0 && end < flags.size()) {
      std::fill(flags.begin() + static_cast<std::ptrdiff_t>(begin),
                flags.begin() + static_cast<std::ptrdiff_t>(end), !value);
    }
    begin = end;
  }
}

// Horizontal speed of a sole point (column) in frame t, m/s, by central differences.
double SpeedAlongGround(std::span<const Soles> soles, double frame_rate, int point, std::size_t t) {
  const std::size_t before = t > 0 ? t - 1 : 0, after = std::min(t + 1, soles.size() - 1);
  const double way = (soles[after].col(point) - soles[before].col(point)).head<2>().norm();
  return way * frame_rate / static_cast<double>(std::max<std::size_t>(after - before, 1));
}

}  // namespace

SolePoints::SolePoints(const Eigen::Matrix3Xd& rest_joints, double floor_y) {
  // GroundProbe provides the sole points; in the rest pose all rotations are the identity.
  std::array<Eigen::Matrix3d, kNumJoints> identity;
  identity.fill(Eigen::Matrix3d::Identity());
  const Eigen::Matrix3Xd at_rest =
      GroundProbe(rest_joints, floor_y).LowestPoints(rest_joints.leftCols<kNumJoints>(), identity);
  for (int i = 0; i < GroundProbe::kNumSoles; ++i) {
    offset_.col(i) = at_rest.col(i) - rest_joints.col(kSoleJoints[static_cast<std::size_t>(i)]);
  }
}

Soles SolePoints::At(const BodyPlacement& placed) const {
  Soles soles;
  for (int i = 0; i < GroundProbe::kNumSoles; ++i) {
    const int joint = kSoleJoints[static_cast<std::size_t>(i)];
    soles.col(i) = placed.joints.col(joint) + placed.rotation[joint] * offset_.col(i);
  }
  return soles;
}

std::vector<Soles> SolePoints::At(std::span<const BodyPlacement> placed) const {
  std::vector<Soles> soles;
  soles.reserve(placed.size());
  for (const BodyPlacement& frame : placed) soles.push_back(At(frame));
  return soles;
}

std::vector<SoleBits> FindContacts(std::span<const Soles> soles, double frame_rate) {
  const std::size_t frames = soles.size();
  std::vector<SoleBits> contacts(frames, 0);
  const auto shortest = static_cast<std::size_t>(kShortestRun * frame_rate + 0.5);
  for (int i = 0; i < GroundProbe::kNumSoles; ++i) {
    std::vector<bool> flags(frames);
    for (std::size_t t = 0; t < frames; ++t) {
      const double speed = SpeedAlongGround(soles, frame_rate, i, t);
      flags[t] = soles[t](2, i) < kContactHeight && speed < kContactSpeed;
    }
    FlipShortRuns(flags, false, shortest);
    FlipShortRuns(flags, true, shortest);
    for (std::size_t t = 0; t < frames; ++t) {
      if (flags[t]) contacts[t] = static_cast<SoleBits>(contacts[t] | (1u << i));
    }
  }
  return contacts;
}

namespace {

constexpr double kHeight = 0.05;      // height above the ground (m) with the same cost as ...
constexpr double kSpeed = 0.35;       // ... this speed along it (m/s), and as a swing foot
constexpr double kMaxPerFrame = 9.0;  // limits the cost of very fast or high feet
constexpr double kChange = 3.0;       // of a change between stance and swing, for one foot
constexpr std::array<unsigned, 3> kStates = {0b01, 0b10, 0b11};  // left, right, both

// Cost of treating a foot as a stance foot. `heel` is the first of its two columns.
double Cost(std::span<const Soles> soles, double frame_rate, int heel, std::size_t t) {
  double least = std::numeric_limits<double>::infinity();
  for (const int point : {heel, heel + 1}) {
    const double speed = SpeedAlongGround(soles, frame_rate, point, t);
    const double height = std::max(soles[t](2, point), 0.0);
    least =
        std::min(least, speed * speed / (kSpeed * kSpeed) + height * height / (kHeight * kHeight));
  }
  return std::min(least, kMaxPerFrame);
}

int NumChanges(unsigned from, unsigned to) {
  return static_cast<int>((from ^ to) == 3u ? 2 : from != to);
}

}  // namespace

std::vector<SoleBits> FindSupports(std::span<const Soles> soles, double frame_rate) {
  const std::size_t frames = soles.size();
  std::vector<SoleBits> contacts = FindContacts(soles, frame_rate);
  if (frames == 0) return contacts;
  std::array<double, kStates.size()> total{};
  std::vector<std::array<std::uint8_t, kStates.size()>> from(frames);
  for (std::size_t t = 0; t < frames; ++t) {
    const double left = Cost(soles, frame_rate, 0, t), right = Cost(soles, frame_rate, 2, t);
    std::array<double, kStates.size()> next{};
    for (std::size_t to = 0; to < kStates.size(); ++to) {
      double best = std::numeric_limits<double>::infinity();
      for (std::size_t s = 0; s < kStates.size(); ++s) {
        const double cost =
            total[s] + (t == 0 ? 0.0 : kChange * NumChanges(kStates[s], kStates[to]));
        if (cost < best) {
          best = cost;
          from[t][to] = static_cast<std::uint8_t>(s);
        }
      }
      // A swing foot costs 1, so at kSpeed on the ground stance and swing cost the same.
      next[to] =
          best + ((kStates[to] & 1u) != 0 ? left : 1.0) + ((kStates[to] & 2u) != 0 ? right : 1.0);
    }
    total = next;
  }
  auto state = static_cast<std::size_t>(std::ranges::min_element(total) - total.begin());
  for (std::size_t t = frames; t-- > 0; state = from[t][state]) {
    for (const int heel : {0, 2}) {
      const auto foot = static_cast<SoleBits>(3u << heel);
      const bool carries = (kStates[state] & (heel == 0 ? 1u : 2u)) != 0;
      if (!carries) {
        contacts[t] = static_cast<SoleBits>(contacts[t] & ~foot);
      } else if ((contacts[t] & foot) == 0) {
        const int lowest = soles[t](2, heel) < soles[t](2, heel + 1) ? heel : heel + 1;
        contacts[t] = static_cast<SoleBits>(contacts[t] | (1u << lowest));
      }
    }
  }
  return contacts;
}

namespace {

constexpr std::array<Side, 2> kSides = {Side::kLeft, Side::kRight};
constexpr double kMaxRise = 0.04;  // meters, of a foot out of reach
constexpr double kMinBend = 3.0 * std::numbers::pi / 180.0;

Limb WalkingLeg(Side side) {
  Limb leg = Leg(side);
  leg.min_flexion_rad = kMinBend;
  return leg;
}

Eigen::Vector3d HipOf(const Eigen::Matrix3Xd& rest_joints, const Limb& leg,
                      const BodyFrame& frame) {
  return frame.pelvis + frame.local[0] * (rest_joints.col(leg.root) - rest_joints.col(0));
}

Eigen::Quaterniond Relative(const Eigen::Matrix3d& parent, const Eigen::Matrix3d& child) {
  return Eigen::Quaterniond(Eigen::Matrix3d(parent.transpose() * child)).normalized();
}

}  // namespace

FeetTarget FeetOf(const BodyPlacement& placed) {
  FeetTarget feet;
  for (std::size_t k = 0; k < kSides.size(); ++k) {
    const int ankle = Leg(kSides[k]).end;
    feet.ankle[k] = placed.joints.col(ankle);
    feet.rotation[k] = placed.rotation[ankle];
  }
  return feet;
}

std::vector<FeetTarget> FeetOf(std::span<const BodyPlacement> placed) {
  std::vector<FeetTarget> feet;
  feet.reserve(placed.size());
  for (const BodyPlacement& frame : placed) feet.push_back(FeetOf(frame));
  return feet;
}

double PlaceLegs(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet, BodyFrame& frame) {
  const BodyPlacement placed = Place(rest_joints, frame);
  double missed = 0.0;
  for (std::size_t k = 0; k < kSides.size(); ++k) {
    const Limb leg = WalkingLeg(kSides[k]);
    const Eigen::Vector3d hip = placed.joints.col(leg.root);
    // The knee direction of a straight leg is undefined, and a network may bend a leg backwards. In
    // both cases the front of the thigh is used.
    const Eigen::Vector3d middle = 0.5 * (hip + placed.joints.col(leg.end));
    const Eigen::Vector3d front = placed.rotation[leg.root].col(2);
    const Eigen::Vector3d knee = placed.joints.col(leg.middle) - middle;
    const Eigen::Vector3d pole = knee + (0.05 - std::min(0.0, knee.dot(front))) * front;
    const LimbPose solved = SolveLimb(rest_joints, leg, hip, feet.ankle[k], pole);
    frame.local[leg.root] = Relative(placed.rotation[0], solved.upper);
    frame.local[leg.middle] = Relative(solved.upper, solved.lower);
    frame.local[leg.end] = Relative(solved.lower, feet.rotation[k]);
    missed = std::max(missed, (solved.end - feet.ankle[k]).norm());
  }
  return missed;
}

double DrawIntoReach(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame,
                     FeetTarget& feet) {
  double drawn = 0.0;
  for (std::size_t k = 0; k < kSides.size(); ++k) {
    const Limb leg = WalkingLeg(kSides[k]);
    const Eigen::Vector3d hip = HipOf(rest_joints, leg, frame);
    const Eigen::Vector3d place = feet.ankle[k] - hip;
    const double reach = MaxReach(rest_joints, leg);
    if (place.norm() <= reach) continue;
    Eigen::Vector3d to = place * (reach / place.norm());
    to.z() = std::min(to.z(), place.z() + kMaxRise);
    const double across = std::sqrt(std::max(0.0, reach * reach - to.z() * to.z()));
    to.head<2>() = place.head<2>().normalized() * across;
    feet.ankle[k] = hip + to;
    drawn = std::max(drawn, (to - place).norm());
  }
  return drawn;
}

std::vector<double> PelvisSink(const Eigen::Matrix3Xd& rest_joints,
                               const std::vector<BodyFrame>& frames,
                               const std::vector<FeetTarget>& feet) {
  const int count = static_cast<int>(frames.size());
  std::vector<double> needed(frames.size(), 0.0);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (std::size_t k = 0; k < kSides.size(); ++k) {
      const Limb leg = WalkingLeg(kSides[k]);
      const Eigen::Vector3d to_ankle = feet[t].ankle[k] - HipOf(rest_joints, leg, frames[t]);
      const double reach = MaxReach(rest_joints, leg);
      const double across = std::min(to_ankle.head<2>().norm(), reach);
      const double highest = std::sqrt(reach * reach - across * across);
      needed[t] = std::max(needed[t], -to_ankle.z() - highest);
    }
  }
  // A sliding maximum followed by a bell of the same width is smooth and never less than needed.
  constexpr int kRadius = 5;
  std::vector<double> greatest(frames.size(), 0.0), sink(frames.size(), 0.0);
  for (int t = 0; t < count; ++t) {
    for (int s = std::max(0, t - kRadius); s <= std::min(count - 1, t + kRadius); ++s) {
      greatest[t] = std::max(greatest[t], needed[s]);
    }
  }
  for (int t = 0; t < count; ++t) {
    double total = 0.0;
    for (int s = -kRadius; s <= kRadius; ++s) {
      const double weight = 1.0 + std::cos(std::numbers::pi * s / (kRadius + 1.0));
      sink[t] += weight * greatest[std::clamp(t + s, 0, count - 1)];
      total += weight;
    }
    sink[t] /= total;
  }
  return sink;
}

}  // namespace holdfast
