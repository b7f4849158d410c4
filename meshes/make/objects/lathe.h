// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/mesh/mesh.h"
#include "meshes/make/objects/curves.h"

namespace holdfast {

struct LatheOptions {
  double max_edge = 3.0;        ///< mm, along the profile and around it
  double chord_error = 0.05;    ///< mm, how far a chord may lie from the round it stands for
  double sharp_degrees = 25.0;  ///< a profile vertex that turns more is a sharp edge, kept exactly
};

/// The solid of revolution around z of `profile` (x: radius, y: height; millimetres), meshed ring
/// by ring so that thin walls and sharp edges come out exact. The profile starts and ends on the
/// axis and runs counter-clockwise seen with the radius to the right: up along the outside. Result
/// in mm.
TriangleMesh Lathe(const solids::Outline& profile, const LatheOptions& options);

}  // namespace holdfast
