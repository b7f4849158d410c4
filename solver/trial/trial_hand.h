// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/grip/grip.h"

namespace holdfast {

/// A rigid part of a hand in a trial. Its frame is that of its joint; lengths in meters.
struct TrialLink {
  int parent = -1;  ///< an earlier link; -1: fixed, in the hand's frame
  Eigen::Vector3d joint = Eigen::Vector3d::Zero();  ///< in the parent's frame
  std::vector<TriangleMesh> pieces;                 ///< convex, in its own frame
  /// A ball joint, unless `parent` is -1: parent_from_link as fitted.
  Eigen::Quaterniond fitted = Eigen::Quaterniond::Identity();
  Eigen::Vector3d flexion = Eigen::Vector3d::UnitX();  ///< unit axis, in its own frame
  double stiffness_Nm = 0.0;                           ///< per radian about that axis
  double torque_limit_Nm = 0.0;                        ///< of the muscles, about that axis
  double side_stiffness_Nm = 0.0;                      ///< per radian about the other two
};

/// Stiffness (Nm/rad) and torque limits (Nm) by joint of a finger: knuckle, middle, end.
struct FingerStrength {
  Eigen::Vector3d stiffness_Nm{3.0, 2.0, 1.0};
  Eigen::Vector3d torque_limit_Nm{1.5, 1.0, 0.5};
  double side_stiffness_Nm = 5.0;
};

/// Returns a hand as rigid links: 0 is the palm, fixed, in the wrist's frame; 1 to 15 the finger
/// joints in file order. Pieces are convex hulls of the posed skin (one per phalanx, and five
/// strips of the palm, one per finger); neighbors share the triangles between them. `state` must
/// have its pose set and evaluated.
std::vector<TrialLink> LinksOfHand(const HandState& state, const FingerStrength& strength);

/// Returns the deepest point of each piece with skin closer than `touch_m` to the object, in the
/// wrist's frame, with zero forces.
std::vector<GripContact> ContactsOfHand(const HandState& state,
                                        const Eigen::Isometry3d& world_from_object,
                                        const SignedDistance& object, double touch_m);

}  // namespace holdfast
