// SPDX-License-Identifier: MIT
#include "solver/robot_hand/robot_joints.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr double kLeastRange = 1e-4;  // radians or metres: less is none
constexpr double kTurn_rad = 2.0 * std::numbers::pi, kSlide_m = 1.0;  // no joint needs more

struct Followed {
  std::string leader;
  double factor = 1.0, offset = 0.0;
};

// A follower of a follower follows the first.
Followed Resolve(const std::map<std::string, const RobotJointSource*>& by_name,
                 const std::string& source, const RobotJointSource& joint) {
  Followed followed{joint.name, 1.0, 0.0};
  const RobotJointSource* at = &joint;
  for (std::size_t steps = 0; !at->follows.empty(); ++steps) {
    const auto next = by_name.find(at->follows);
    if (next == by_name.end()) {
      throw Error(source,
                  fmt::format("joint '{}' follows '{}', which is no joint that moves", at->name,
                              at->follows),
                  "Correct its mimic");
    }
    if (steps > by_name.size()) {
      throw Error(source, fmt::format("joint '{}' follows itself", joint.name),
                  "Correct its mimic");
    }
    followed.offset += followed.factor * at->offset;
    followed.factor *= at->factor;
    at = next->second;
    followed.leader = at->name;
  }
  return followed;
}

void RequireSense(const std::string& source, const RobotJointSource& joint) {
  for (const double value : {joint.low, joint.high, joint.factor, joint.offset}) {
    if (std::isfinite(value)) continue;
    throw Error(source,
                fmt::format("joint '{}' has a limit or mimic that is not finite", joint.name),
                "Correct its numbers");
  }
  if (joint.low > joint.high) {
    throw Error(source,
                fmt::format("the limits of joint '{}' are {} to {}: the lower one is above",
                            joint.name, joint.low, joint.high),
                "Swap them");
  }
}

// Limits that stand for none: their middle would be nowhere.
void Narrow(RobotJointKind kind, RobotJointSource& joint, std::vector<std::string>& notes) {
  const bool turns = kind == RobotJointKind::kTurning;
  const double most = turns ? kTurn_rad : kSlide_m;
  if (joint.low >= -most && joint.high <= most) return;
  const double kept = turns ? std::numbers::pi : kSlide_m;
  joint.low = std::clamp(joint.low, -kept, kept);
  joint.high = std::clamp(joint.high, -kept, kept);
  notes.push_back(
      turns ? fmt::format("joint '{}' may turn more than once: taken as half a turn "
                          "either way",
                          joint.name)
            : fmt::format("joint '{}' may slide farther than a metre: taken as that", joint.name));
}

}  // namespace

void ResolveJoints(std::vector<RobotJointSource> joints, RobotHand& hand) {
  for (RobotJointSource& joint : joints) {
    RequireSense(hand.source, joint);
    const auto link = std::ranges::find(hand.links, joint.name, &RobotLink::joint);
    if (link != hand.links.end()) Narrow(link->kind, joint, hand.notes);
  }
  std::map<std::string, const RobotJointSource*> by_name;
  for (const RobotJointSource& joint : joints) {
    if (!by_name.emplace(joint.name, &joint).second) {
      throw Error(hand.source, fmt::format("has two joints named '{}'", joint.name),
                  "Rename one of them");
    }
  }
  std::map<std::string, int> dof_of;
  const auto dof_named = [&](const std::string& leader) {
    const auto [found, added] = dof_of.emplace(leader, hand.NumDofs());
    const RobotJointSource& joint = *by_name.at(leader);
    if (added) hand.dofs.push_back({leader, joint.low, joint.high});
    return found->second;
  };
  for (RobotLink& link : hand.links) {
    const auto found = by_name.find(link.joint);
    if (link.kind == RobotJointKind::kFixed || found == by_name.end()) continue;
    const RobotJointSource& joint = *found->second;
    const Followed followed = Resolve(by_name, hand.source, joint);
    const RobotJointSource& leader = *by_name.at(followed.leader);
    if (followed.factor == 0.0 || leader.high - leader.low < kLeastRange) {
      link.offset =
          std::clamp(followed.factor * leader.low + followed.offset, joint.low, joint.high);
      hand.notes.push_back(fmt::format("joint '{}' has no range: it stands still", joint.name));
      continue;
    }
    link.dof = dof_named(followed.leader);
    link.factor = followed.factor;
    link.offset = followed.offset;
    RobotDof& dof = hand.dofs[static_cast<std::size_t>(link.dof)];
    const double one = (joint.low - followed.offset) / followed.factor;
    const double other = (joint.high - followed.offset) / followed.factor;
    const double low = std::min(one, other), high = std::max(one, other);
    // A follower's rounded limits may leave a hair less than its leader's: no reason to complain.
    if (low < dof.high && high > dof.low) {
      dof.low = std::max(dof.low, low);
      dof.high = std::min(dof.high, high);
    }
  }
  for (const RobotDof& dof : hand.dofs) {
    if (!(dof.high > dof.low)) {
      throw Error(hand.source,
                  fmt::format("the limits of joint '{}' are {} to {}", dof.name, dof.low, dof.high),
                  "Correct its limits");
    }
  }
}

Eigen::VectorXd RobotHand::Straight() const { return Clamped(Eigen::VectorXd::Zero(NumDofs())); }

Eigen::VectorXd RobotHand::Clamped(const Eigen::VectorXd& q) const {
  Eigen::VectorXd within = q;
  for (int k = 0; k < NumDofs(); ++k) within(k) = std::clamp(q(k), dofs[k].low, dofs[k].high);
  return within;
}

int RobotHand::FindLink(const std::string& link) const {
  for (int k = 0; k < NumLinks(); ++k) {
    if (links[k].name == link) return k;
  }
  return -1;
}

}  // namespace holdfast
