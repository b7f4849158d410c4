// SPDX-License-Identifier: MIT
#include "generator/matching/support_feet.h"

#include <algorithm>
#include <array>
#include <limits>

namespace holdfast {
namespace {

constexpr double kHeight = 0.05;       // metres above the ground that cost as much as...
constexpr double kSpeed = 0.35;        // ... this speed along it, m/s, or as being left out
constexpr double kMostPerFrame = 9.0;  // beyond, it does not matter how fast or high
constexpr double kChange = 3.0;        // of one foot, from carrying to not and back
constexpr std::array<unsigned, 3> kStates = {0b01, 0b10, 0b11};  // left, right, both

// What it costs to say of a foot that it carries. `heel` is the first of its two columns.
double Cost(std::span<const Soles> soles, double frame_rate, int heel, std::size_t t) {
  double least = std::numeric_limits<double>::infinity();
  for (const int point : {heel, heel + 1}) {
    const double speed = SpeedAlongGround(soles, frame_rate, point, t);
    const double height = std::max(soles[t](2, point), 0.0);
    least =
        std::min(least, speed * speed / (kSpeed * kSpeed) + height * height / (kHeight * kHeight));
  }
  return std::min(least, kMostPerFrame);
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
      // A foot left out costs 1: at kSpeed on the ground either is as good.
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

}  // namespace holdfast
