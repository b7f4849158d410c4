// SPDX-License-Identifier: MIT
// Robots' files, URDF and MJCF: our own check of them here, the libraries in their own process.
#include <algorithm>
#include <fstream>
#include <string>

#include "geometry/robot/robot_hand.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

HOLDFAST_FUZZ_TARGET(robot) {
  using namespace holdfast;
  const std::string text(trial.Text());
  const bool is_mjcf = text.find("<mujoco") != std::string::npos;
  const fuzz::ScratchFile file(is_mjcf ? ".xml" : ".urdf");
  std::ofstream(file.Path(), std::ios::binary) << text;
  const RobotHand hand = ReadRobotHand(file.Path());
  trial.Accept();
  fuzz::Require(hand.NumDofs() > 0 && hand.NumDofs() <= 200, "numbers of the hand out of range");
  for (int k = 0; k < hand.NumLinks(); ++k) {
    const RobotLink& link = hand.links[static_cast<std::size_t>(k)];
    fuzz::Require(link.parent < k && link.dof < hand.NumDofs(), "an id is out of range");
    fuzz::Require(link.parent_from_joint.matrix().allFinite(), "a pose is not finite");
    for (const TriangleMesh& shape : link.shapes) {
      fuzz::Require(shape.vertices.allFinite(), "a shape is not finite");
      fuzz::Require(shape.faces.size() == 0 || (shape.faces.minCoeff() >= 0 &&
                                                shape.faces.maxCoeff() < shape.NumVertices()),
                    "a face is out of range");
    }
  }
  for (const RobotDof& dof : hand.dofs) fuzz::Require(dof.low < dof.high, "bounds are none");
}
