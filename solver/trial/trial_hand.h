// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/io/gltf/mjcf_writer.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/grip/grip.h"

namespace holdfast {

/// Stiffness (Nm/rad) and torque limits (Nm) by joint of a finger: knuckle, middle, end.
struct FingerStrength {
  Eigen::Vector3d stiffness_Nm{3.0, 2.0, 1.0};
  Eigen::Vector3d torque_limit_Nm{1.5, 1.0, 0.5};
  double side_stiffness_Nm = 5.0;
};

/// Axes of a link's springs: flexion (unit) first, which the muscles act about.
Eigen::Matrix3d SpringAxes(const Eigen::Vector3d& flexion);

/// Returns a hand as rigid links: 0 is the palm, fixed, in the wrist's frame; 1 to 15 the finger
/// joints in file order. Pieces are convex hulls of the posed skin (one per phalanx, and five
/// strips of the palm, one per finger); neighbors share the triangles between them. `state` must
/// have its pose set and evaluated.
std::vector<MjcfLink> LinksOfHand(const HandState& state, const FingerStrength& strength);

/// Returns the deepest point of each piece with skin closer than `touch_m` to the object, in the
/// wrist's frame, with zero forces.
std::vector<GripContact> ContactsOfHand(const HandState& state,
                                        const Eigen::Isometry3d& world_from_object,
                                        const SignedDistance& object, double touch_m);

}  // namespace holdfast
