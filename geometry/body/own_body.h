// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"

namespace holdfast {

/// The skin of a person without the arms, as an obstacle for arm motion: trunk, neck, head and
/// legs; for a held object also any arm that does not hold it. Const and shareable between threads.
/// OwnBody::Posed holds the posed skin.
class OwnBody {
 public:
  /// `body` has all vertices. `left_out`: arms to exclude (bits as in Clip::holding_hand: 1 right,
  /// 2 left). A face is excluded if one of its corners moves mostly with that arm's shoulder joint
  /// or its descendants (shoulder, elbow, wrist, fingers).
  OwnBody(const BodySurface& body, std::uint8_t left_out);

  struct Touch {
    double depth = 0.0;       ///< meters, positive inside
    Eigen::Vector3d surface;  ///< the nearest point of the skin
    Eigen::Vector3d normal;   ///< unit, outwards, of the skin's nearest feature
  };

  /// The skin in one pose, near a box.
  class Posed {
   public:
    /// `vertices` (3 x N, must outlive this): all of the body's, posed, meters, world. Faces
    /// farther than `margin_m` from the box [low, high] are culled; query points must lie in the
    /// box.
    Posed(const OwnBody& body, const Eigen::Matrix3Xd& vertices, const Eigen::Vector3d& low,
          const Eigen::Vector3d& high, double margin_m = 0.1);
    ~Posed();

    /// Depth of a point in the body (negative outside), with the nearest skin. Returns nothing if
    /// no skin is within the margin, or if the nearest skin is the rim of an excluded arm.
    /// `within_m`: a known upper bound of the distance to the skin (faster if it is small).
    std::optional<Touch> Query(const Eigen::Vector3d& point, double within_m = 1e9) const;

   private:
    struct Impl;
    std::unique_ptr<const Impl> impl_;
  };

  /// Skin of an arm that must not penetrate the body: vertices that move mostly with elbow, wrist
  /// or fingers of `side` (forearm and hand), except those within 8 cm of the elbow in the rest
  /// pose.
  static std::vector<int> ForearmAndHand(const BodySurface& body, Side side);

 private:
  struct Tree;
  std::shared_ptr<const Tree> tree_;
};

}  // namespace holdfast
