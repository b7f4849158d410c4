// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "geometry/score/exact_intersection.h"

namespace holdfast {

/// Whether a closed surface goes around a point: its faces are passed outwards more often than
/// inwards on the way out of it. Where a surface crosses itself, the nearest face does not tell.
bool GoesAround(const Solid& closed, const Eigen::Vector3d& point);

/// How far numbered points were from a solid when they were last asked for, and so how far they are
/// at least and at most when they or the solid have moved a little since: from frame to frame most
/// need no new query. That a point is outside is taken over too, for as long as no surface can have
/// passed it.
class ClearanceMemory {
 public:
  /// Keeps a reference to `solid`. For points 0 to `points` - 1.
  ClearanceMemory(const Solid& solid, std::size_t points) : solid_(solid), known_(points) {}

  /// The solid's surface has moved: none of its points farther than this, metres.
  void SurfaceMoved(double farthest_m) { travelled_ += farthest_m; }

  /// How far point i, now at `point`, is outside the solid at least, metres; zero or less where
  /// that is not known, as of one that is not closed.
  double OutsideBy(std::size_t i, const Eigen::Vector3d& point) const {
    return Clear(known_[i]) - (point - known_[i].place).norm();
  }

  /// How far it is from the surface at most, inside or outside; infinity where that is not known.
  double AtMost(std::size_t i, const Eigen::Vector3d& point) const {
    const Known& k = known_[i];
    return k.distance + (travelled_ - k.travelled) + (point - k.place).norm();
  }

  /// What the solid says, which is remembered; outside where its surface does not go around the
  /// point, though the nearest face may be seen from behind.
  SignedDistance::Result Query(std::size_t i, const Eigen::Vector3d& point);

 private:
  struct Known {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    double distance = std::numeric_limits<double>::infinity();
    double travelled = 0.0;  // of the surface, by then
    bool outside = false;
    int face = -1;
  };

  double Clear(const Known& k) const {
    return k.outside ? k.distance - (travelled_ - k.travelled) : 0.0;
  }

  const Solid& solid_;
  std::vector<Known> known_;
  double travelled_ = 0.0;
};

}  // namespace holdfast
