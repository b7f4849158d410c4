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

/// Part of a carried object or a person's arms that collides with their own body.
enum class MeetingPart { kNone, kObject, kRightArm, kLeftArm };
std::string_view MeetingPartName(MeetingPart part);  ///< "object", "right arm"; empty for none

/// Detects collisions of object, hands and forearms with the body of the person who carries the
/// object. Const, shared by threads; `body` must outlive it.
class BodyCollisionDetector {
 public:
  /// Samples points about `spacing_m` apart on the object (meters, its own frame) and on hands and
  /// forearms. `left_out`: the values that Measure will be called with.
  BodyCollisionDetector(const BodySurface& body, const TriangleMesh& object,
                        std::span<const std::uint8_t> left_out, double spacing_m = 0.01);

  /// Keeps body and arms, but samples other points.
  void LookAt(const TriangleMesh& object, double spacing_m);

  /// A sample point near the skin.
  struct Point {
    Eigen::Vector3d at;  ///< world, meters
    OwnBody::Touch touch;
    double wrist_share;  ///< weight of following the wrist; the rest follows the elbow
  };
  struct Frame {
    double depth_m = 0.0;  ///< of the deepest point; 0: none inside the body
    MeetingPart part = MeetingPart::kNone;
    double nearest_m = -1.0;  ///< maximum depth of a point, negative outside the skin
    std::array<double, 2> arm_depth_m = {};  ///< for the right and the left arm
    std::array<std::vector<Point>, 2> near;  ///< likewise
  };

  /// Measures one frame. `state` has all vertices; `arms` (bits as in Clip::holding_hand) hold the
  /// object (ignored if none). The obstacle excludes the arms in `left_out` (which include `arms`)
  /// for these and the object, and both arms for the others. Includes points up to `within_m`
  /// outside the skin, those of the object with the right arm where both hold.
  Frame Measure(const BodyState& state, const Eigen::Isometry3d& world_from_object,
                std::uint8_t arms, std::uint8_t left_out, double within_m) const;

 private:
  struct Clusters {
    std::vector<std::vector<int>> members;  // columns near each other
  };
  static Clusters Clustered(const Eigen::Matrix3Xd& points);

  const BodySurface& body_;
  Eigen::Matrix3Xd object_;                   // samples, object frame
  std::array<std::vector<int>, 2> skin_;      // vertices of hand and forearm
  std::array<std::vector<double>, 2> share_;  // of these, weight of following the wrist
  Clusters object_clusters_;
  std::array<Clusters, 2> skin_clusters_;
  std::array<std::optional<OwnBody>, 4> obstacles_;  // by the excluded arms
};

}  // namespace holdfast
