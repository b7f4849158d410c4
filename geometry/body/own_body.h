// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"

namespace holdfast {

/// The skin of a person without their arms, as an obstacle to what the arms do: trunk, neck, head
/// and legs, and, for an object, any arm that does not hold it. Const and shared by threads; the
/// posed skin is in OwnBody::Posed.
class OwnBody {
 public:
  /// `body` has all vertices. `left_out`: the arms (bits as in Clip::holding_hand: 1 right, 2 left)
  /// that do not count: faces with a corner that moves mostly with that arm's shoulder joint or
  /// what lies beyond (shoulder, elbow, wrist, fingers).
  OwnBody(const BodySurface& body, std::uint8_t left_out);

  struct Touch {
    double depth = 0.0;       ///< meters, positive inside
    Eigen::Vector3d surface;  ///< the nearest point of the skin
    Eigen::Vector3d normal;   ///< unit, out of the body, from the skin's nearest feature
  };

  /// The skin in one pose, near a box.
  class Posed {
   public:
    /// `vertices` (3 x N, must outlive this): all of the body's, in the pose, meters, world. Faces
    /// farther than `margin_m` from the box [low, high] are left out: points asked for lie within
    /// it.
    Posed(const OwnBody& body, const Eigen::Matrix3Xd& vertices, const Eigen::Vector3d& low,
          const Eigen::Vector3d& high, double margin_m = 0.1);
    ~Posed();
    Posed(Posed&&) noexcept;

    /// How deep a point is in the body (negative: outside), with the nearest skin. Nothing where no
    /// skin is within the margin, and where the nearest skin is the rim left by an arm that does
    /// not count. `within_m`: the skin is known to be no farther (faster where that is near).
    std::optional<Touch> Query(const Eigen::Vector3d& point, double within_m = 1e9) const;

   private:
    struct Impl;
    std::unique_ptr<const Impl> impl_;
  };

  /// The arm's skin that must keep out of the rest: vertices that move mostly with elbow, wrist or
  /// fingers of `side` (forearm and hand), without those within `from_elbow_m` of the elbow in the
  /// rest pose.
  static std::vector<int> ForearmAndHand(const BodySurface& body, Side side,
                                         double from_elbow_m = 0.08);

 private:
  struct Tree;
  std::shared_ptr<const Tree> tree_;
};

}  // namespace holdfast
