// SPDX-License-Identifier: MIT
#include "solver/robot/finger_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "solver/grasp/grasp_certificate.h"
#include "solver/grasp/grasp_placement.h"

namespace holdfast {
namespace {

constexpr double kPatch_m = 0.005;
constexpr std::array<int, kNumFingers> kOutward = {kThumb, kIndex, kMiddle, kRing, kPinky};

// Contacts that a hand with these fingers keeps.
std::vector<GraspContact> Kept(const HumanFrame& frame, const std::vector<int>& fingers) {
  std::vector<GraspContact> kept;
  for (const PartContact& contact : frame.contacts) {
    const bool of_finger = contact.part < kJointsPerHand;
    if (of_finger && std::ranges::count(fingers, contact.part / 3) == 0) continue;
    const Eigen::Vector3d across = contact.normal.unitOrthogonal();
    const Eigen::Vector3d along = contact.normal.cross(across);
    for (int k = 0; k < 3; ++k) {
      const double angle = 2.0 * std::numbers::pi / 3.0 * k;
      kept.push_back(
          {contact.point + kPatch_m * (std::cos(angle) * across + std::sin(angle) * along),
           -contact.normal});
    }
  }
  return kept;
}

// The least friction of 0.2, 0.3 ... 1.0 with which the contacts hold; more if none does.
double LeastFriction(const std::vector<GraspContact>& contacts, const Eigen::Vector3d& center,
                     double length_m) {
  constexpr int kMaxTenths = 10;
  int tenths = 2;
  while (tenths <= kMaxTenths && !HoldsGravity(contacts, center, length_m, 0.1 * tenths)) ++tenths;
  return 0.1 * tenths;
}

}  // namespace

std::vector<int> ChooseFingers(const HumanFrame& frame, const TriangleMesh& object, int fingers) {
  const Eigen::Vector3d center = SolidCentroid(object);
  const double length_m = (object.vertices.colwise() - center).colwise().norm().maxCoeff();
  std::vector<int> best;
  double least = 0.0;
  // Subsets in lexicographic order: the first fingers come first.
  std::array<bool, kNumFingers> taken{};
  std::fill_n(taken.begin(), fingers, true);
  do {
    if (fingers > 2 && !taken[0]) break;
    std::vector<int> chosen;
    for (std::size_t k = 0; k < taken.size(); ++k) {
      if (taken[k]) chosen.push_back(kOutward[k]);
    }
    const double friction = LeastFriction(Kept(frame, chosen), center, length_m);
    if (best.empty() || friction < least - 0.05) {
      least = friction;
      best = chosen;
    }
  } while (std::ranges::prev_permutation(taken).found);
  return best;
}

}  // namespace holdfast
