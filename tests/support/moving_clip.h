// SPDX-License-Identifier: MIT
#pragma once

#include <random>

#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast::testing {

/// A smooth motion of every joint, the root and an object: sums of slow sines, up to half a radian
/// (a whole turn for the root and the object). Asymmetric, so that a mixed-up axis shows.
inline Clip MakeMovingClip(int num_frames, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  JointPose size, phase, speed;
  for (auto* m : {&size, &phase, &speed}) {
    for (double& x : m->reshaped()) x = uniform(random);
  }
  Clip clip;
  clip.trans.resize(3, num_frames);
  clip.pose.resize(num_frames);
  ObjectTrack track;
  track.name = "thing";
  track.trans.resize(3, num_frames);
  track.orient.resize(3, num_frames);
  for (int t = 0; t < num_frames; ++t) {
    clip.pose[t] = 0.5 * size.array() * (5 * phase.array() + 0.1 * t * speed.array()).sin();
    const double turn = 0.2 * t;
    clip.pose[t].col(0) = Eigen::Vector3d(1.3, 0.4 + turn, -0.3);
    clip.trans.col(t) << 0.3 + 0.02 * t, -0.5, 1.1 + 0.01 * t;
    track.trans.col(t) << 0.1 * t, 0.4, 0.9;
    track.orient.col(t) << 0.2, turn - 2, 0.7;
  }
  clip.object = track;
  return clip;
}

/// A small closed mesh without symmetry.
inline TriangleMesh Tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 0.1, 0, 0, 0, 0, 0.2, 0, 0, 0, 0, 0.3;
  mesh.faces.resize(3, 4);
  mesh.faces << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
  return mesh;
}

}  // namespace holdfast::testing
