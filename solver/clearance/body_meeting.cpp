// SPDX-License-Identifier: MIT
#include "solver/clearance/body_meeting.h"

#include <algorithm>
#include <numeric>

#include "geometry/mesh/contact_samples.h"

namespace holdfast {
namespace {

constexpr double kSpacing_m = 0.01;
constexpr int kMostSamples = 300;
constexpr double kDeepest_m = 0.1;  // deeper is not told from outside
constexpr int kClusterSize = 8;

// Vertices about kSpacing_m apart in the rest pose.
std::vector<int> Thinned(const BodySurface& body, const std::vector<int>& vertices) {
  std::vector<int> kept;
  for (const int i : vertices) {
    const bool near = std::ranges::any_of(kept, [&](int k) {
      return (body.RestVertices().col(i) - body.RestVertices().col(k)).squaredNorm() <
             kSpacing_m * kSpacing_m;
    });
    if (!near) kept.push_back(i);
  }
  return kept;
}

double ShareOfHand(const BodySurface& body, int vertex, Side side) {
  double share = 0.0;
  for (const auto& [joint, weight] : body.Weights(vertex)) {
    const bool finger = joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand;
    if (finger || joint == WristJoint(side)) share += weight;
  }
  return share;
}

// Calls visit(i) for the points that may be in the skin or within `within_m` of it.
template <typename Visit>
void ForEachNear(const OwnBody::Posed& skin, const Eigen::Matrix3Xd& points,
                 const std::vector<std::vector<int>>& clusters, double within_m,
                 const Visit& visit) {
  for (const std::vector<int>& members : clusters) {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const int i : members) center += points.col(i);
    center /= static_cast<double>(members.size());
    double radius = 0.0;
    for (const int i : members) radius = std::max(radius, (points.col(i) - center).norm());
    const auto touch = skin.Query(center);
    if (touch && -touch->depth > radius + within_m) continue;
    for (const int i : members) visit(i);
  }
}

}  // namespace

std::string_view MeetingPartName(MeetingPart part) {
  switch (part) {
    case MeetingPart::kObject:
      return "object";
    case MeetingPart::kRightArm:
      return "right arm";
    case MeetingPart::kLeftArm:
      return "left arm";
    default:
      return "";
  }
}

BodyMeeting::BodyMeeting(const BodySurface& body, const TriangleMesh& object,
                         std::span<const std::uint8_t> left_out)
    : body_(body),
      object_(ContactSamples(object, kSpacing_m, kMostSamples)),
      object_clusters_(Clustered(object_)) {
  for (const std::uint8_t bits : left_out) {
    if (!obstacles_[bits & 3]) obstacles_[bits & 3].emplace(body, bits);
  }
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const int a = side == Side::kRight ? 0 : 1;
    skin_[a] = Thinned(body, OwnBody::ForearmAndHand(body, side));
    for (const int i : skin_[a]) share_[a].push_back(ShareOfHand(body, i, side));
    skin_clusters_[a] = Clustered(body.RestVertices()(Eigen::all, skin_[a]));
  }
}

BodyMeeting::Clusters BodyMeeting::Clustered(const Eigen::Matrix3Xd& points) {
  Clusters clusters;
  std::vector<int> order(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  const auto split = [&](const auto& self, auto begin, auto end) -> void {
    if (begin == end) return;
    if (end - begin <= kClusterSize) {
      clusters.members.emplace_back(begin, end);
      return;
    }
    Eigen::AlignedBox3d box;
    for (auto i = begin; i != end; ++i) box.extend(points.col(*i));
    Eigen::Index axis;
    box.sizes().maxCoeff(&axis);
    const auto middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end, [&](int a, int b) {
      return std::pair(points(axis, a), a) < std::pair(points(axis, b), b);
    });
    self(self, begin, middle);
    self(self, middle, end);
  };
  split(split, order.begin(), order.end());
  return clusters;
}

BodyMeeting::Frame BodyMeeting::Measure(const BodyState& state,
                                        const Eigen::Isometry3d& world_from_object,
                                        std::uint8_t arms, std::uint8_t left_out,
                                        double within_m) const {
  Frame frame;
  const Eigen::Matrix3Xd object = world_from_object * object_;
  std::array<Eigen::Matrix3Xd, 2> skin;
  Eigen::AlignedBox3d box(object.rowwise().minCoeff(), object.rowwise().maxCoeff());
  for (int a = 0; a < 2; ++a) {
    if ((arms & (1 << a)) == 0) continue;
    skin[a] = state.vertices(Eigen::all, skin_[a]);
    if (skin[a].cols() == 0) continue;
    box.extend(skin[a].rowwise().minCoeff()).extend(skin[a].rowwise().maxCoeff());
  }
  const OwnBody::Posed body(*obstacles_[left_out & 3], state.vertices, box.min(), box.max(),
                            kDeepest_m);
  const auto look = [&](const Eigen::Vector3d& at, int arm, double wrist_share, MeetingPart part) {
    const auto touch = body.Query(at);
    if (!touch || touch->depth < -within_m) return;
    frame.near[arm].push_back({at, *touch, wrist_share});
    if (touch->depth <= frame.depth_m) return;
    frame.depth_m = touch->depth;
    frame.part = part;
  };
  ForEachNear(body, object, object_clusters_.members, within_m, [&](int i) {
    look(object.col(i), (arms & 1) != 0 ? 0 : 1, 1.0, MeetingPart::kObject);
  });
  for (int a = 0; a < 2; ++a) {
    if ((arms & (1 << a)) == 0) continue;
    ForEachNear(body, skin[a], skin_clusters_[a].members, within_m, [&](int i) {
      look(skin[a].col(i), a, share_[a][i],
           a == 0 ? MeetingPart::kRightArm : MeetingPart::kLeftArm);
    });
  }
  return frame;
}

}  // namespace holdfast
