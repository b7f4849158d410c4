// SPDX-License-Identifier: MIT
#include "solver/robot/robot_anatomy.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <system_error>
#include <utility>

#include <Eigen/Geometry>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/robot/robot_kinematics.h"
#include "solver/robot/contact_file.h"

namespace holdfast {
namespace {

// Fractions of a human finger's length at which its middle and end phalanges begin.
constexpr std::array<double, 2> kPhalanxBegins = {0.45, 0.75};
constexpr double kShortSegment = 0.45;  // of the mean: shorter segments are not separate phalanges

// A finger not yet identified: links from the palm to the tip, fixed ones included.
using Chain = std::vector<int>;

class Anatomist {
 public:
  Anatomist(const RobotHand& hand, Side if_unclear)
      : hand_(hand),
        if_unclear_(if_unclear),
        state_(hand),
        children_(hand.links.size()),
        moves_(hand.links.size()) {
    for (int k = hand.NumLinks() - 1; k >= 0; --k) {
      const RobotLink& link = hand.links[k];
      if (link.parent < 0) continue;
      children_[link.parent].push_back(k);
      if (link.dof >= 0 || moves_[k]) moves_[link.parent] = true;
    }
    for (auto& children : children_) std::ranges::reverse(children);
  }

  std::vector<Chain> FindChains();
  RobotAnatomy Describe(std::vector<RobotFinger> fingers, const std::set<int>& of_fingers);
  RobotFinger FingerOf(const Chain& chain);
  void SetPads(std::vector<RobotFinger>& fingers);
  void SortFingers(std::vector<RobotFinger>& fingers);

 private:
  // Descendants of `link`, itself first.
  std::vector<int> Below(int link) const {
    std::vector<int> all{link};
    for (std::size_t k = 0; k < all.size(); ++k) {
      all.insert(all.end(), children_[all[k]].begin(), children_[all[k]].end());
    }
    return all;
  }
  std::vector<int> PathTo(int link) const {
    std::vector<int> path;
    for (; link >= 0; link = hand_.links[link].parent) path.push_back(link);
    std::ranges::reverse(path);
    return path;
  }
  Eigen::Vector3d Origin(int link) const { return state_.RootFromLink(link).translation(); }
  Eigen::Vector3d TipOf(const std::vector<int>& links, int last_joint) const;
  std::vector<int> AllLinks(const RobotFinger& finger) const {
    std::vector<int> all;
    for (const auto& links : finger.links) all.insert(all.end(), links.begin(), links.end());
    return all;
  }
  // Base and tip of a finger in a configuration, with the tip's Jacobian.
  struct Reach {
    Eigen::Vector3d base, tip;
    Eigen::Matrix3Xd J_tip;
  };
  Reach ReachAt(const RobotFinger& finger, const Eigen::VectorXd& q);
  Eigen::Vector3d BendOf(const RobotFinger& finger, const Eigen::Vector3d& others);
  void SetFrame(RobotAnatomy& anatomy);

  const RobotHand& hand_;
  Side if_unclear_;
  RobotState state_;
  std::vector<std::vector<int>> children_;
  std::vector<bool> moves_;        // whether the link has a moving descendant
  std::map<int, double> closing_;  // by degree of freedom: the bound that bends the finger
};

std::vector<Chain> Anatomist::FindChains() {
  std::vector<int> ends;
  for (int k = 0; k < hand_.NumLinks(); ++k) {
    if (hand_.links[k].dof >= 0 && !moves_[k]) ends.push_back(k);
  }
  if (ends.size() < 2) {
    throw Error(hand_.source, ends.empty() ? "has no fingers" : "has a single finger",
                "Give a hand with at least two fingers, or assign its links with --correspondence");
  }
  std::map<int, int> times;  // links on the paths to several ends belong to the palm
  for (const int end : ends) {
    for (const int link : PathTo(end)) ++times[link];
  }
  state_.Evaluate(hand_.Straight());
  std::vector<std::pair<double, Chain>> found;
  for (const int end : ends) {
    Chain chain;
    for (const int link : PathTo(end)) {
      if (times[link] == 1) chain.push_back(link);
    }
    const std::vector<int> last = Below(end);
    chain.insert(chain.end(), last.begin() + 1, last.end());
    if (std::ranges::all_of(chain, [&](int k) { return hand_.links[k].shapes.empty(); })) continue;
    found.emplace_back((TipOf(chain, end) - Origin(chain.front())).norm(), chain);
  }
  // Inner bars of a linkage end before the finger that they drive.
  double longest = 0.0;
  for (const auto& [length, chain] : found) longest = std::max(longest, length);
  std::vector<Chain> chains;
  for (auto& [length, chain] : found) {
    if (length > 0.4 * longest) chains.push_back(std::move(chain));
  }
  if (chains.size() < 2 || chains.size() > kNumFingers) {
    throw Error(hand_.source, fmt::format("has {} fingers", chains.size()),
                "Assign the links of two to five fingers with --correspondence");
  }
  return chains;
}

// Returns the extreme surface point along the last bone.
Eigen::Vector3d Anatomist::TipOf(const std::vector<int>& links, int last_joint) const {
  const auto at = std::ranges::find(links, last_joint);
  const Eigen::Vector3d origin = Origin(last_joint);
  Eigen::Matrix3Xd points(3, 0);
  const auto add = [&](int link) {
    for (const TriangleMesh& shape : hand_.links[link].shapes) {
      const Eigen::Index n = points.cols();
      points.conservativeResize(Eigen::NoChange, n + shape.vertices.cols());
      points.rightCols(shape.vertices.cols()) = state_.RootFromLink(link) * shape.vertices;
    }
  };
  std::for_each(at, links.end(), add);
  if (points.cols() == 0) return Origin(links.back());
  // The bone points to the farther part of the shape: points are weighted by distance.
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto point : points.colwise()) sum += (point - origin).norm() * (point - origin);
  if (sum.norm() < 1e-12) return origin;
  const Eigen::Vector3d bone = sum.normalized();
  return origin + (bone.transpose() * (points.colwise() - origin)).maxCoeff() * bone;
}

RobotFinger Anatomist::FingerOf(const Chain& chain) {
  state_.Evaluate(hand_.Straight());
  std::vector<int> joints;
  for (const int link : chain) {
    if (hand_.links[link].dof >= 0) joints.push_back(link);
  }
  std::vector<Eigen::Vector3d> nodes;
  for (const int joint : joints) nodes.push_back(Origin(joint));
  nodes.push_back(TipOf(chain, joints.back()));
  // Merge coincident joints, then short segments, then the first two of a long thumb.
  while (nodes.size() > 2) {
    double total = 0.0, least = std::numeric_limits<double>::infinity();
    std::size_t shortest = 0;
    for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
      const double length = (nodes[k + 1] - nodes[k]).norm();
      total += length;
      if (length < least) {
        least = length;
        shortest = k;
      }
    }
    if (least < kShortSegment * total / static_cast<double>(nodes.size() - 1)) {
      nodes.erase(nodes.begin() + static_cast<std::ptrdiff_t>(shortest));
    } else if (nodes.size() > 4) {
      nodes.erase(nodes.begin() + 1);
    } else {
      break;
    }
  }
  RobotFinger finger;
  const auto along = [&](double part) {
    double left = 0.0;
    for (std::size_t k = 0; k + 1 < nodes.size(); ++k) left += (nodes[k + 1] - nodes[k]).norm();
    left *= part;
    for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
      const double length = (nodes[k + 1] - nodes[k]).norm();
      if (left <= length || k + 2 == nodes.size()) {
        return Eigen::Vector3d(nodes[k] + left / length * (nodes[k + 1] - nodes[k]));
      }
      left -= length;
    }
    return nodes.back();
  };
  finger.nodes = {nodes.front(), along(kPhalanxBegins[0]), along(kPhalanxBegins[1]), nodes.back()};
  if (nodes.size() == 4) std::ranges::copy(nodes, finger.nodes.begin());
  // A link belongs to the phalanx nearest to the center of its shape.
  for (const int link : chain) {
    Eigen::AlignedBox3d box;
    for (const TriangleMesh& shape : hand_.links[link].shapes) {
      for (const auto v : shape.vertices.colwise()) box.extend(state_.RootFromLink(link) * v);
    }
    const Eigen::Vector3d middle = box.isEmpty() ? Origin(link) : Eigen::Vector3d(box.center());
    std::array<double, 3> away;
    for (int p = 0; p < 3; ++p) {
      const Eigen::Vector3d bone = finger.nodes[p + 1] - finger.nodes[p];
      const double t =
          std::clamp((middle - finger.nodes[p]).dot(bone) / bone.squaredNorm(), 0.0, 1.0);
      away[p] = (middle - finger.nodes[p] - t * bone).norm();
    }
    const auto nearest = std::ranges::min_element(away) - away.begin();
    finger.links[nearest].push_back(link);
  }
  return finger;
}

Anatomist::Reach Anatomist::ReachAt(const RobotFinger& finger, const Eigen::VectorXd& q) {
  state_.Evaluate(hand_.Straight());
  const std::vector<int> links = AllLinks(finger);
  const int first = links.front(), last = links.back();
  const Eigen::Vector3d base = state_.RootFromLink(first).inverse() * finger.nodes[0];
  const Eigen::Vector3d tip = state_.RootFromLink(last).inverse() * finger.nodes[3];
  state_.Evaluate(q);
  Reach reach;
  reach.base = state_.RootFromLink(first) * base;
  reach.tip = state_.RootFromLink(last) * tip;
  reach.J_tip = state_.PointJacobian(last, reach.tip);
  return reach;
}

// Displacement of the straight finger's tip on bending; `others`: mean of the other tips.
Eigen::Vector3d Anatomist::BendOf(const RobotFinger& finger, const Eigen::Vector3d& others) {
  const Eigen::VectorXd straight = hand_.Straight();
  const Reach reach = ReachAt(finger, straight);
  const double length = (reach.tip - reach.base).norm();
  Eigen::Vector3d bend = Eigen::Vector3d::Zero();
  std::set<int> numbers;
  for (const int joint : state_.Chain(AllLinks(finger).back())) {
    if (std::ranges::count(AllLinks(finger), joint) > 0) numbers.insert(hand_.links[joint].dof);
  }
  for (const int k : numbers) {
    Eigen::VectorXd low = straight, high = straight;
    low(k) = hand_.dofs[k].low;
    high(k) = hand_.dofs[k].high;
    const Reach a = ReachAt(finger, low), b = ReachAt(finger, high);
    const double shorter = (a.tip - a.base).norm() - (b.tip - b.base).norm();
    if (std::abs(shorter) < 0.03 * length) continue;
    closing_[k] = shorter > 0.0 ? hand_.dofs[k].high : hand_.dofs[k].low;
    // A finger that is straight at its bound does not shorten at first: look a little further.
    Eigen::VectorXd slightly = straight;
    slightly(k) += 0.15 * (closing_[k] - straight(k));
    bend += ReachAt(finger, slightly).tip - reach.tip;
  }
  if (bend.norm() > 1e-6) return bend;
  for (const int k : numbers) {
    const Eigen::Vector3d way = reach.J_tip.col(k);
    const double towards = way.dot(others - reach.tip);
    closing_[k] = towards > 0.0 ? hand_.dofs[k].high : hand_.dofs[k].low;
    bend += towards > 0.0 ? way : -way;
  }
  return bend;
}

void Anatomist::SetPads(std::vector<RobotFinger>& fingers) {
  for (RobotFinger& finger : fingers) {
    Eigen::Vector3d others = Eigen::Vector3d::Zero();
    for (const RobotFinger& other : fingers) {
      if (&other != &finger) others += other.nodes[3];
    }
    others /= static_cast<double>(fingers.size() - 1);
    const Eigen::Vector3d bend = BendOf(finger, others);
    for (int p = 0; p < 3; ++p) {
      const Eigen::Vector3d bone = (finger.nodes[p + 1] - finger.nodes[p]).normalized();
      const Eigen::Vector3d across = bend - bend.dot(bone) * bone;
      finger.pads[p] =
          across.norm() > 1e-9 ? Eigen::Vector3d(across.normalized()) : bone.unitOrthogonal();
    }
    // Base joints bend in the direction that moves the tip towards the pad.
    const Reach reach = ReachAt(finger, hand_.Straight());
    for (int k = 0; k < hand_.NumDofs(); ++k) {
      const double towards = reach.J_tip.col(k).dot(finger.pads[2]);
      if (closing_.contains(k) || std::abs(towards) < 0.5 * reach.J_tip.col(k).norm() ||
          reach.J_tip.col(k).isZero()) {
        continue;
      }
      closing_[k] = towards > 0.0 ? hand_.dofs[k].high : hand_.dofs[k].low;
    }
  }
}

// Puts the thumb first.
void Anatomist::SortFingers(std::vector<RobotFinger>& fingers) {
  Eigen::VectorXd half = hand_.Straight();
  for (const auto& [k, end] : closing_) half(k) += 0.5 * (end - half(k));
  std::vector<Eigen::Vector3d> points, bends;
  for (const RobotFinger& finger : fingers) {
    const Reach reach = ReachAt(finger, half);
    points.push_back((reach.tip - reach.base).normalized());
    Eigen::Vector3d bend = Eigen::Vector3d::Zero();
    for (const auto& [k, end] : closing_) {
      bend += reach.J_tip.col(k) * (end > hand_.Straight()(k) ? 1.0 : -1.0);
    }
    bends.push_back(bend.norm() > 1e-9 ? Eigen::Vector3d(bend.normalized()) : bend);
  }
  const auto likeness = [&](std::size_t i) {
    double sum = 0.0;
    for (std::size_t j = 0; j < fingers.size(); ++j) {
      if (j != i) sum += points[i].dot(points[j]) + bends[i].dot(bends[j]);
    }
    return sum;
  };
  std::size_t thumb = 0;
  for (std::size_t i = 1; i < fingers.size(); ++i) {
    if (likeness(i) < likeness(thumb) - 1e-9) thumb = i;
  }
  std::swap(fingers[0], fingers[thumb]);
  fingers[0].human = kThumb;
}

void Anatomist::SetFrame(RobotAnatomy& anatomy) {
  auto& fingers = anatomy.fingers;
  Eigen::Vector3d forward = Eigen::Vector3d::Zero(), bend = Eigen::Vector3d::Zero();
  anatomy.knuckles.setZero();
  for (std::size_t i = 1; i < fingers.size(); ++i) {
    forward += (fingers[i].nodes[3] - fingers[i].nodes[0]).normalized();
    bend += fingers[i].pads[0] + fingers[i].pads[1] + fingers[i].pads[2];
    anatomy.knuckles += fingers[i].nodes[0];
  }
  anatomy.knuckles /= static_cast<double>(fingers.size() - 1);
  forward.normalize();
  bend -= bend.dot(forward) * forward;
  Eigen::Vector3d out = bend.norm() > 1e-6 ? Eigen::Vector3d(bend.normalized())
                                           : Eigen::Vector3d(forward.unitOrthogonal());
  // The palm of a gripper (parallel fingers that close on each other) faces along its fingers.
  const Eigen::Vector3d thumb_bone = (fingers[0].nodes[3] - fingers[0].nodes[0]).normalized();
  anatomy.gripper = thumb_bone.dot(forward) > 0.7 && fingers[0].pads[0].dot(out) < -0.7;
  if (anatomy.gripper) {
    std::swap(forward, out);
    forward = -forward;
  }
  anatomy.open = anatomy.closed = hand_.Straight();
  for (const auto& [k, end] : closing_) anatomy.closed(k) = end;
  for (const RobotLink& link : hand_.links) {
    const bool opens = anatomy.gripper || link.kind == RobotJointKind::kSliding;
    if (!opens || !closing_.contains(link.dof)) continue;
    const RobotDof& dof = hand_.dofs[link.dof];
    anatomy.open(link.dof) = dof.low + dof.high - closing_[link.dof];
  }
  // Seen from the palm with fingers up, the thumb of a right hand is on the right: forward x out.
  const Eigen::Vector3d right = forward.cross(out);
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (std::size_t i = 1; i < fingers.size(); ++i) {
    const double at = (fingers[i].nodes[0] - anatomy.knuckles).dot(right);
    least = std::min(least, at);
    most = std::max(most, at);
  }
  Eigen::Vector3d thumb = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& node : fingers[0].nodes) thumb += 0.25 * node;
  const double beside = (thumb - anatomy.knuckles).dot(right);
  anatomy.palm_width = std::max(most - least, 0.02);
  anatomy.side_is_clear = std::abs(beside) > 0.1 * anatomy.palm_width && fingers.size() > 2;
  anatomy.side = !anatomy.side_is_clear ? if_unclear_ : beside > 0.0 ? Side::kRight : Side::kLeft;
  const double sign = anatomy.side == Side::kLeft ? -1.0 : 1.0;
  anatomy.root_from_axes << forward, sign * right, out;
}

RobotAnatomy Anatomist::Describe(std::vector<RobotFinger> fingers,
                                 const std::set<int>& of_fingers) {
  RobotAnatomy anatomy;
  anatomy.fingers = std::move(fingers);
  SetFrame(anatomy);
  // The palm includes what is attached to it, rigidly or not, and belongs to no finger. It excludes
  // its parents (an arm) unless they are rigidly connected.
  state_.Evaluate(hand_.Straight());
  std::vector<int> ways = PathTo(*of_fingers.begin());
  for (const RobotFinger& finger : anatomy.fingers) {
    const std::vector<int> path = PathTo(AllLinks(finger).front());
    ways.erase(std::ranges::mismatch(ways, path).in1, ways.end());
  }
  int top = ways.empty() ? 0 : ways.back();
  while (hand_.links[top].parent >= 0 && hand_.links[top].dof < 0) top = hand_.links[top].parent;
  double heel = 0.0;
  for (const int link : Below(top)) {
    if (of_fingers.contains(link)) continue;
    anatomy.palm_links.push_back(link);
    for (const TriangleMesh& shape : hand_.links[link].shapes) {
      for (const auto v : shape.vertices.colwise()) {
        heel = std::max(
            heel,
            (anatomy.knuckles - state_.RootFromLink(link) * v).dot(anatomy.root_from_axes.col(0)));
      }
    }
  }
  anatomy.palm_length = std::clamp(heel, 0.02, std::max(0.05, 1.5 * anatomy.palm_width));
  return anatomy;
}

}  // namespace

double RobotFinger::Length() const {
  double length = 0.0;
  for (int p = 0; p < 3; ++p) length += (nodes[p + 1] - nodes[p]).norm();
  return length;
}

RobotAnatomy FindAnatomy(const RobotHand& hand, Side if_unclear) {
  Anatomist anatomist(hand, if_unclear);
  std::vector<RobotFinger> fingers;
  std::set<int> of_fingers;
  for (const Chain& chain : anatomist.FindChains()) {
    fingers.push_back(anatomist.FingerOf(chain));
    of_fingers.insert(chain.begin(), chain.end());
  }
  anatomist.SetPads(fingers);
  anatomist.SortFingers(fingers);
  RobotAnatomy anatomy = anatomist.Describe(std::move(fingers), of_fingers);
  std::sort(anatomy.fingers.begin() + 1, anatomy.fingers.end(),
            [&](const RobotFinger& a, const RobotFinger& b) {
              return (a.nodes[0] - b.nodes[0]).dot(anatomy.root_from_axes.col(1)) > 0.0;
            });
  constexpr std::array<int, 4> kOrder = {kIndex, kMiddle, kRing, kPinky};
  for (std::size_t i = 1; i < anatomy.fingers.size(); ++i) anatomy.fingers[i].human = kOrder[i - 1];
  return anatomy;
}

std::vector<PartLink> ReadCorrespondence(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) {
    throw Error(path.string(), "is not a regular file", "Give a CSV file");
  }
  std::ifstream file(path);
  if (!file) throw Error(path.string(), "cannot be read", "Check the path");
  std::vector<PartLink> parts;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() == '#') continue;
    const std::size_t comma = line.find(',');
    if (number == 1 && line == "part,link") continue;
    if (comma == std::string::npos || comma == 0 || comma + 1 == line.size() ||
        line.find(',', comma + 1) != std::string::npos) {
      throw Error(fmt::format("{}:{}", path.string(), number), "is not a line 'part,link'",
                  "Write lines such as index1,link_1.0 under the header part,link");
    }
    parts.push_back({line.substr(0, comma), line.substr(comma + 1)});
  }
  if (parts.empty()) throw Error(path.string(), "has no lines", "Write lines 'part,link'");
  return parts;
}

RobotAnatomy AnatomyOf(const RobotHand& hand, const std::vector<PartLink>& parts,
                       const std::string& source, Side if_unclear) {
  std::map<int, std::array<std::vector<int>, 3>> by_finger;
  std::set<int> of_fingers, used;
  std::vector<int> palm;
  for (const PartLink& row : parts) {
    const int link = hand.FindLink(row.link);
    if (link < 0) {
      throw Error(source,
                  fmt::format("names the link '{}', which {} does not have", row.link, hand.source),
                  "Name links as the robot's file does");
    }
    if (!used.insert(link).second) {
      throw Error(source, fmt::format("has the link '{}' twice", row.link),
                  "Leave one of them out");
    }
    const int part = ParseHandPart(row.part);
    if (part == kJointsPerHand) {
      palm.push_back(link);
      continue;
    }
    if (part < 0) {
      throw Error(source, fmt::format("has the unknown part '{}'", row.part),
                  "Use the parts palm, thumb1 ... thumb3, index1 ... pinky3");
    }
    by_finger[part / 3][part % 3].push_back(link);
    of_fingers.insert(link);
  }
  if (by_finger.size() < 2 || !by_finger.contains(kThumb)) {
    throw Error(source, "does not give a thumb and a finger",
                "Give links of the thumb and of at least one finger");
  }
  Anatomist anatomist(hand, if_unclear);
  std::vector<RobotFinger> fingers;
  for (const int human : {kThumb, kIndex, kMiddle, kRing, kPinky}) {
    const auto found = by_finger.find(human);
    if (found == by_finger.end()) continue;
    Chain chain;
    for (auto& links : found->second) {
      std::ranges::sort(links);
      chain.insert(chain.end(), links.begin(), links.end());
    }
    if (std::ranges::none_of(chain, [&](int k) { return hand.links[k].dof >= 0; })) {
      throw Error(source, fmt::format("assigns no movable link to {}", kFingerNames[human]),
                  "Name the links that its joints move");
    }
    RobotFinger finger = anatomist.FingerOf(chain);
    finger.links = found->second;
    finger.human = human;
    fingers.push_back(std::move(finger));
  }
  anatomist.SetPads(fingers);
  RobotAnatomy anatomy = anatomist.Describe(std::move(fingers), of_fingers);
  if (!palm.empty()) anatomy.palm_links = palm;
  return anatomy;
}

std::vector<PartLink> PartLinksOf(const RobotHand& hand, const RobotAnatomy& anatomy) {
  std::vector<PartLink> parts;
  for (const int link : anatomy.palm_links) parts.push_back({"palm", hand.links[link].name});
  for (const RobotFinger& finger : anatomy.fingers) {
    for (int p = 0; p < 3; ++p) {
      for (const int link : finger.links[p]) {
        parts.push_back({HandPartName(3 * finger.human + p), hand.links[link].name});
      }
    }
  }
  return parts;
}

}  // namespace holdfast
