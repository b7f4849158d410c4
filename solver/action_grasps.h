// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "geometry/distance_grid.h"
#include "geometry/hand_model.h"
#include "geometry/mesh.h"
#include "geometry/signed_distance.h"
#include "solver/grasp.h"

namespace holdfast {

/// An object as actions are made with it, const and shared.
struct ActionObject {
  const TriangleMesh& mesh;
  const SignedDistance& surface;
  const DistanceGrid& distance;
};

/// Ways in which a hand can hold an object: clean grasps (CloseHand's), best first, no two nearly
/// alike (wrists 2 cm or 20 degrees apart). Up is wherever a hand at a table has it. Empty when the
/// hand cannot hold it; `status` tells why.
std::vector<Grasp> FindActionGrasps(const HandModel& hand, const ActionObject& object,
                                    std::uint64_t seed, int most, GraspStatus* status = nullptr);

/// The left hand's grasps from those of the right hand on the reflected object (ReflectX), of a
/// body whose two sides mirror each other.
Grasp MirrorGrasp(const Grasp& grasp);

/// Two hands that can hold the object at once.
struct GraspPair {
  int right = 0, left = 0;  ///< indices
  double clearance_m = 0.0;  ///< between the hands' skin, and from hand to forearm
};

/// All pairs whose hands keep clear of each other, by score, at most `most`.
std::vector<GraspPair> PairGrasps(const HandModel& right_hand, const std::vector<Grasp>& right,
                                  const HandModel& left_hand, const std::vector<Grasp>& left,
                                  int most);

/// The hand's skin with a grasp's fingers, in the wrist's frame: every `every`-th vertex (3 x n).
Eigen::Matrix3Xd SkinInWrist(const HandModel& hand, const FingerPose& fingers, int every);

}  // namespace holdfast
