// SPDX-License-Identifier: MIT
#include "solver/trial/trial_hand.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/convex_hull.h"
#include "geometry/rotation.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {
namespace {

constexpr double kMinLinkPiece_m3 = 1e-10;
constexpr double kLinkSection_m = 0.015;

// The finger whose metacarpal is nearest to a point of the palm.
int PalmStrip(const HandState& state, const Eigen::Vector3d& point) {
  const auto joints = state.JointPositions();
  int nearest = 0;
  double least = 1e9;
  for (int finger = 0; finger < kNumFingers; ++finger) {
    const Eigen::Vector3d along = joints.col(3 * finger) - state.WristPosition();
    const Eigen::Vector3d from = point - state.WristPosition();
    const double s = std::clamp(along.dot(from) / along.squaredNorm(), 0.0, 1.0);
    const double distance = (from - s * along).norm();
    if (distance < least) {
      least = distance;
      nearest = finger;
    }
  }
  return nearest;
}

// Piece of each vertex: 0..14 phalanges, 15..19 strips of the palm.
std::vector<int> PieceOfVertices(const HandState& state) {
  const HandModel& hand = state.Hand();
  std::vector<int> pieces = StrongestHandJoints(hand.Surface(), hand.HandSide());
  for (int v = 0; v < hand.NumVertices(); ++v) {
    int& piece = pieces[static_cast<std::size_t>(v)];
    piece = piece >= HandBegin(hand.HandSide())
                ? piece - HandBegin(hand.HandSide())
                : kJointsPerHand + PalmStrip(state, state.Vertices().col(v));
  }
  return pieces;
}

int LinkOfPiece(int piece) { return piece < kJointsPerHand ? piece + 1 : 0; }

}  // namespace

Eigen::Matrix3d SpringAxes(const Eigen::Vector3d& flexion) {
  const Eigen::Vector3d across = flexion.unitOrthogonal();
  Eigen::Matrix3d axes;
  axes << flexion, across, flexion.cross(across);
  return axes;
}

std::vector<MjcfLink> LinksOfHand(const HandState& state, const FingerStrength& strength) {
  const HandModel& hand = state.Hand();
  const HandAxes axes(hand);
  const int first = HandBegin(hand.HandSide()), wrist = WristJoint(hand.HandSide());
  std::vector<MjcfLink> links(1 + kJointsPerHand);
  std::vector<Eigen::Isometry3d> link_from_world = {state.WorldFromWrist().inverse()};
  const FingerPose fingers = state.Fingers();
  for (int j = 0; j < kJointsPerHand; ++j) {
    MjcfLink& link = links[static_cast<std::size_t>(j + 1)];
    link.parent = j % 3 == 0 ? 0 : j;
    const int parent = j % 3 == 0 ? wrist : first + j - 1;
    link.joint =
        hand.Surface().RestJoints().col(first + j) - hand.Surface().RestJoints().col(parent);
    link.rest = ExpSO3(fingers.segment<3>(3 * j));
    link.axes = SpringAxes(axes.Axes(j).col(0));
    link.stiffness_Nm << strength.stiffness_Nm[j % 3], strength.side_stiffness_Nm,
        strength.side_stiffness_Nm;
    link.limit_Nm << strength.torque_limit_Nm[j % 3], 0.0, 0.0;
    link_from_world.push_back(
        RigidTransform(state.JointRotation(j), state.JointPositions().col(j)).inverse());
  }
  // A hull of a whole link would fill the hollow of the palm and the inside of a bent joint.
  const std::vector<int> piece_of = PieceOfVertices(state);
  const auto section_of = [&](int v) {
    const int piece = piece_of[static_cast<std::size_t>(v)], link = LinkOfPiece(piece);
    const Eigen::Vector3d along = link == 0 ? axes.Forward() : axes.Bone(piece);
    const Eigen::Vector3d point =
        link_from_world[static_cast<std::size_t>(link)] * state.Vertices().col(v);
    return std::pair(piece, static_cast<int>(std::floor(along.dot(point) / kLinkSection_m)));
  };
  std::map<std::pair<int, int>, std::set<int>> vertices;
  for (const auto face : hand.Surface().Faces().colwise()) {
    for (const int corner : face) vertices[section_of(corner)].insert(face.begin(), face.end());
  }
  for (const auto& [section, ids] : vertices) {
    const auto link = static_cast<std::size_t>(LinkOfPiece(section.first));
    const std::vector<int> columns(ids.begin(), ids.end());
    const Eigen::Matrix3Xd points = link_from_world[link] * state.Vertices()(Eigen::all, columns);
    TriangleMesh hull = ConvexHull(points);
    if (SignedVolume(hull) > kMinLinkPiece_m3) links[link].pieces.push_back(std::move(hull));
  }
  return links;
}

std::vector<GripContact> ContactsOfHand(const HandState& state,
                                        const Eigen::Isometry3d& world_from_object,
                                        const SignedDistance& object, double touch_m) {
  const Eigen::Isometry3d wrist_from_world = state.WorldFromWrist().inverse();
  const Eigen::Isometry3d object_from_world = world_from_object.inverse();
  const std::vector<int> piece_of = PieceOfVertices(state);
  std::map<int, std::pair<double, GripContact>> deepest;
  for (int v = 0; v < state.Hand().NumVertices(); ++v) {
    const SignedDistance::Result near = object.Query(object_from_world * state.Vertices().col(v));
    const int piece = piece_of[static_cast<std::size_t>(v)];
    const auto found = deepest.find(piece);
    if (near.distance > touch_m) continue;
    if (found != deepest.end() && found->second.first <= near.distance) continue;
    const Eigen::Isometry3d wrist_from_object = wrist_from_world * world_from_object;
    GripContact contact;
    contact.link = LinkOfPiece(piece);
    contact.point = wrist_from_object * near.closest;
    contact.into = -(wrist_from_object.linear() * near.gradient).normalized();
    deepest[piece] = {near.distance, contact};
  }
  std::vector<GripContact> contacts;
  for (const auto& [piece, contact] : deepest) contacts.push_back(contact.second);
  return contacts;
}

}  // namespace holdfast
