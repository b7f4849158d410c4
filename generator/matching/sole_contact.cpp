// SPDX-License-Identifier: MIT
#include "generator/matching/sole_contact.h"

#include <algorithm>

namespace holdfast {
namespace {

constexpr std::array<int, GroundProbe::kNumSoles> kSoleJoints = {7, 10, 8, 11};
constexpr double kContactHeight = 0.04;  // metres
constexpr double kContactSpeed = 0.35;   // m/s: a sole that rolls over the ball
constexpr double kShortestRun = 0.1;     // seconds

// Runs of `value` shorter than `shortest`, with something else on both sides, become the other.
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

}  // namespace

SolePoints::SolePoints(const Eigen::Matrix3Xd& rest_joints, double floor_y) {
  // GroundProbe knows where soles are; at rest all rotations are the identity.
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

double SpeedAlongGround(std::span<const Soles> soles, double frame_rate, int point, std::size_t t) {
  const std::size_t before = t > 0 ? t - 1 : 0, after = std::min(t + 1, soles.size() - 1);
  const double way = (soles[after].col(point) - soles[before].col(point)).head<2>().norm();
  return way * frame_rate / static_cast<double>(std::max<std::size_t>(after - before, 1));
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

}  // namespace holdfast
