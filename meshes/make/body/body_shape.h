// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "meshes/make/body/body_skeleton.h"
#include "meshes/make/body/sculpture.h"

namespace holdfast {

inline const Eigen::Vector3d kX = Eigen::Vector3d::UnitX();
inline const Eigen::Vector3d kY = Eigen::Vector3d::UnitY();
inline const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

/// The left hand from the wrist on: palm with the balls of thumb and little finger, five fingers.
struct HandShape {
  Sculpture palm;
  std::array<Sculpture, kNumFingers> fingers;

  double operator()(const Eigen::Vector3d& point) const;
};
HandShape MakeLeftHand();

Sculpture MakeHead();
Sculpture MakeTrunk();
Sculpture MakeLeftArm();  ///< shoulder to wrist
Sculpture MakeLeftLeg();  ///< hip to toes

/// The surface of the default body as the zero set of a function, symmetric in x. Metres, rest
/// pose.
class BodyShape {
 public:
  BodyShape();

  /// Negative inside; near the surface close to the signed distance.
  double operator()(const Eigen::Vector3d& point) const;
  /// Central differences.
  Eigen::Vector3d Gradient(const Eigen::Vector3d& point) const;
  /// The nearest point of the surface for points near it; on the plane x = 0 if `on_midline`.
  Eigen::Vector3d Project(const Eigen::Vector3d& point, bool on_midline) const;

 private:
  Sculpture trunk_, head_, arm_, leg_;
  HandShape hand_;
};

/// How long the edges of the mesh should be at a point of the surface, metres: short on the
/// fingers, longer on palm, face and feet, longest on trunk and limbs, with a smooth transition.
double TargetEdgeLength(const Eigen::Vector3d& point);

}  // namespace holdfast
