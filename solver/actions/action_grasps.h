// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "generator/actions/object_marks.h"
#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/grasp/grasp.h"

namespace holdfast {

/// An object as actions are made with it, const and shared.
struct ActionObject {
  const TriangleMesh& mesh;
  const SignedDistance& surface;
  const DistanceGrid& distance;
};

/// Ways in which a hand can hold an object: clean grasps (CloseHand's), best first, no two nearly
/// alike (wrists 2 cm or 20 degrees apart). Up is wherever a hand at a table has it. Empty when the
/// hand cannot hold it; `status` tells why. The same on any number of `threads`.
std::vector<Grasp> FindActionGrasps(const HandModel& hand, const ActionObject& object,
                                    std::uint64_t seed, int most, GraspStatus* status = nullptr,
                                    int threads = 1);

/// Ways in which a hand holds a tool that it works hard with: the grip in the palm, the thumb's
/// side towards the head, wherever up is; not how it is picked up from a table. Empty where there
/// are none.
std::vector<Grasp> FindToolGrips(const HandModel& hand, const ActionObject& object,
                                 std::uint64_t seed, int most, int threads = 1);

/// Adds to each grasp of an object with two sides (ObjectMarks::two_sided) the same with the object
/// turned over in the hand. From above, a right hand takes a hammer that lies on one side with the
/// face to the front, and one that lies on the other with the claw there.
void AddTurnedOver(const ObjectMarks& marks, std::vector<Grasp>& grasps);

/// The hand's skin with a grasp's fingers, in the wrist's frame: every `every`-th vertex (3 x n).
Eigen::Matrix3Xd SkinInWrist(const HandModel& hand, const FingerPose& fingers, int every);

}  // namespace holdfast
