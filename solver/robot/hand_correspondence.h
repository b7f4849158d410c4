// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/mesh.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/robot/robot_anatomy.h"

namespace holdfast {

/// A place of the human hand's skin and the robot's that stands for it.
struct SkinPair {
  int vertex = 0;    ///< of the human hand (HandModel)
  int part = 0;      ///< of it: 15 phalanges, then the palm
  bool pad = false;  ///< on the touching side
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< in the link's frame, meters
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outwards, unit, in the link's frame
};

/// Pairs for the fingers that the robot has, and the palm's touching side. Both hands straight: a
/// vertex is told by how far along its phalanx it is (as a share) and in which direction off the
/// bone, from the pad's; the robot's point is where that direction, seen from outside, first meets
/// the robot's finger. The palm's go by their place between knuckles and heel. Vertices with
/// nothing there have no pair.
std::vector<SkinPair> PairSkins(const HandModel& human, const HandLandmarks& landmarks,
                                const HandAxes& axes, const RobotHand& robot,
                                const RobotAnatomy& anatomy);

/// All shapes of a link as one mesh, in its frame; it may overlap itself.
TriangleMesh LinkMesh(const RobotLink& link);

}  // namespace holdfast
