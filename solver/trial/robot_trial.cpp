// SPDX-License-Identifier: MIT
#include "solver/trial/robot_trial.h"

#include <algorithm>
#include <vector>

#include "geometry/mesh/convex_hull.h"
#include "solver/trial/robot_scene.h"

namespace holdfast {
namespace {

constexpr double kHingeSide_Nm = 50.0;  // per radian, keeps a ball joint on its hinge axis

// Robot links as trial links: rigid links are merged into the moving link they are attached to.
std::vector<TrialLink> TrialLinks(const RobotTransferSetup& setup, const RobotPose& pose,
                                  const FingerStrength& strength, std::vector<int>& body_of) {
  const RobotHand& robot = setup.robot;
  RobotState state(robot);
  state.Evaluate(pose.q);
  std::vector<TrialLink> links(1);
  std::vector<int> frame_of{0};  // the robot link whose frame a trial link has
  body_of.assign(robot.links.size(), 0);
  for (int k = 0; k < robot.NumLinks(); ++k) {
    const RobotLink& link = robot.links[k];
    const int parent = link.parent < 0 ? 0 : body_of[link.parent];
    body_of[k] = parent;
    if (link.dof >= 0) {
      body_of[k] = static_cast<int>(links.size());
      const Eigen::Isometry3d parent_from_link =
          (parent == 0 ? Eigen::Isometry3d::Identity()
                       : state.RootFromLink(frame_of[parent]).inverse()) *
          state.RootFromLink(k);
      TrialLink body;
      body.parent = parent;
      body.joint = parent_from_link.translation();
      body.fitted = Eigen::Quaterniond(parent_from_link.linear());
      body.flexion = link.axis;
      body.stiffness_Nm = strength.stiffness_Nm(0);
      body.torque_limit_Nm = strength.torque_limit_Nm(0);
      body.side_stiffness_Nm = kHingeSide_Nm;
      links.push_back(body);
      frame_of.push_back(k);
    }
    if (std::ranges::count(setup.solids->Links(), k) == 0) continue;
    const Eigen::Isometry3d body_from_link =
        (body_of[k] == 0 ? Eigen::Isometry3d::Identity()
                         : state.RootFromLink(frame_of[body_of[k]]).inverse()) *
        state.RootFromLink(k);
    for (const TriangleMesh& shape : robot.links[k].shapes) {
      TriangleMesh hull = ConvexHull(shape.vertices);
      if (hull.NumFaces() == 0) continue;
      hull.vertices = body_from_link * hull.vertices;
      links[body_of[k]].pieces.push_back(std::move(hull));
    }
  }
  return links;
}

}  // namespace

int FullestFrame(const HumanDemonstration& demonstration) {
  const auto fullest = std::ranges::max_element(
      demonstration.frames, {}, [](const HumanFrame& f) { return f.contacts.size(); });
  return static_cast<int>(fullest - demonstration.frames.begin());
}

std::optional<HoldTrial> TryRobotHold(const RobotTransferSetup& setup, const RobotPose& pose,
                                      const TrialSolid& solid, const TrialProtocol& protocol) {
  const bool slides = std::ranges::any_of(setup.robot.links, [](const RobotLink& link) {
    return link.dof >= 0 && link.kind == RobotJointKind::kSliding;
  });
  if (slides) return std::nullopt;
  std::vector<int> body_of;
  const std::vector<TrialLink> links = TrialLinks(setup, pose, protocol.fingers, body_of);
  std::vector<GripContact> contacts = GripOfRobot(setup, pose, solid, protocol);
  for (GripContact& contact : contacts) contact.link = body_of[contact.link];
  return TryHold(links, contacts, solid, pose.ObjectFromRoot().inverse(), protocol);
}

HoldTrial TryHumanHold(const RobotTransferSetup& setup, const Clip& clip, int frame,
                       const TrialSolid& solid, const TrialProtocol& protocol) {
  HandState human(*setup.human);
  human.SetBody(clip.pose[frame], clip.trans.col(frame));
  human.Evaluate(FingersOf(clip.pose[frame], setup.demonstration.side), false);
  return TryHold(human, setup.demonstration.frames[frame].world_from_object, solid,
                 *setup.object_distance, protocol);
}

}  // namespace holdfast
