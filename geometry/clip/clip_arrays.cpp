// SPDX-License-Identifier: MIT
#include "geometry/clip/clip_arrays.h"

#include <cstdint>
#include <optional>

#include "geometry/body/skeleton.h"

namespace holdfast {

Clip MirrorClip(const Clip& clip, const Eigen::Vector3d& root) {
  Clip mirrored = clip;
  mirrored.trans.row(0) = -(mirrored.trans.row(0).array() + 2.0 * root.x());
  for (JointPose& pose : mirrored.pose) pose = MirrorPose(pose);
  for (std::optional<ObjectTrack>* track : {&mirrored.object, &mirrored.table}) {
    if (!*track) continue;
    (*track)->trans.row(0) *= -1.0;
    (*track)->orient.bottomRows<2>() *= -1.0;
  }
  for (std::uint8_t& hands : mirrored.holding_hand) {
    hands = static_cast<std::uint8_t>(((hands & kHoldsRight) != 0 ? kHoldsLeft : 0) |
                                      ((hands & kHoldsLeft) != 0 ? kHoldsRight : 0));
  }
  return mirrored;
}

TriangleMesh MirrorMesh(TriangleMesh mesh) {
  mesh.vertices.row(0) *= -1.0;
  mesh.faces.row(1).swap(mesh.faces.row(2));
  return mesh;
}

}  // namespace holdfast
