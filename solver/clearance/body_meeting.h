// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/body/own_body.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// What of a carried object and a person's arms is in their own body.
enum class MeetingPart { kNone, kObject, kRightArm, kLeftArm };
std::string_view MeetingPartName(MeetingPart part);  ///< "object", "right arm"; empty for none

/// Where object, hands and forearms meet the body of the person who carries. Const, shared by
/// threads; `body` must outlive it.
class BodyCollisionDetector {
 public:
  /// Looks at points about `spacing_m` apart on the object (meters, its own frame) and on hands and
  /// forearms. `left_out`: those that Measure is to be asked for.
  BodyCollisionDetector(const BodySurface& body, const TriangleMesh& object,
                        std::span<const std::uint8_t> left_out, double spacing_m = 0.01);

  /// The same body and the same arms, looked at at other points.
  void LookAt(const TriangleMesh& object, double spacing_m);

  /// A point near the skin.
  struct Point {
    Eigen::Vector3d at;  ///< world, meters
    OwnBody::Touch touch;
    double wrist_share;  ///< how much it goes along with the wrist; the rest with the elbow
  };
  struct Frame {
    double depth_m = 0.0;  ///< of the deepest point; 0: none is in the body
    MeetingPart part = MeetingPart::kNone;
    double nearest_m = -1.0;  ///< depth of the point nearest to the skin or deepest in it
    std::array<double, 2> arm_depth_m = {};  ///< with the right arm and the left one
    std::array<std::vector<Point>, 2> near;  ///< the same
  };

  /// One frame. `state` has all vertices. `arms` (bits as in Clip::holding_hand) hold the object:
  /// it counts where there are any. `left_out` (these among them) are no obstacle to it and to each
  /// other; of the other arms, no arm is one. Points outside the skin by up to `within_m` are given
  /// too, the object's with the right arm where both hold.
  Frame Measure(const BodyState& state, const Eigen::Isometry3d& world_from_object,
                std::uint8_t arms, std::uint8_t left_out, double within_m) const;

 private:
  struct Clusters {
    std::vector<std::vector<int>> members;  // columns that are near each other
  };
  static Clusters Clustered(const Eigen::Matrix3Xd& points);

  const BodySurface& body_;
  Eigen::Matrix3Xd object_;                   // samples, object's frame
  std::array<std::vector<int>, 2> skin_;      // vertices of hand and forearm
  std::array<std::vector<double>, 2> share_;  // of these, with the wrist
  Clusters object_clusters_;
  std::array<Clusters, 2> skin_clusters_;
  std::array<std::optional<OwnBody>, 4> obstacles_;  // by the arms left out
};

}  // namespace holdfast
