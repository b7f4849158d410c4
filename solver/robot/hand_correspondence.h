// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/mesh.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/robot/robot_anatomy.h"

namespace holdfast {

/// A point on the skin of the human hand and the corresponding point on the robot.
struct SkinPair {
  int vertex = 0;    ///< vertex of the human hand (HandModel)
  int part = 0;      ///< part of the human hand: 15 phalanges, then the palm
  bool pad = false;  ///< on the palmar side
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< in the link's frame, meters
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outward unit normal, in the link's frame
};

/// Returns correspondences for the fingers that the robot has and for the palmar side of the palm.
/// Both hands are straight. A vertex is given by its fraction along the phalanx and its direction
/// off the bone relative to the pad; the robot's point is the first intersection, from outside, of
/// that direction with the robot's finger. Palm vertices are given by their position between
/// knuckles and heel. Vertices without an intersection have no pair.
std::vector<SkinPair> PairSkins(const HandModel& human, const HandLandmarks& landmarks,
                                const HandAxes& axes, const RobotHand& robot,
                                const RobotAnatomy& anatomy);

/// Returns all shapes of a link as one mesh in the link's frame; the mesh may self-intersect.
TriangleMesh LinkMesh(const RobotLink& link);

}  // namespace holdfast
