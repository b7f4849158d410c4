// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// The pose correctives of one clip in a few directions: what a skinned mesh with morph targets
/// needs to show the body model's surface instead of bare linear blend skinning.
///
///   v_p(t) = rest + sum_k coefficients(k, t) directions_k      (within max_error_m)
///
/// v(t) follows from v_p(t) by the model's ordinary skinning.
struct CorrectiveBasis {
  Eigen::Matrix3Xd rest;       ///< v_s (3 x V), rest pose, meters
  Eigen::MatrixXf directions;  ///< (3V x K) meters, one direction per column: x y z of each vertex
  Eigen::MatrixXf coefficients;  ///< (K x T), each row's largest magnitude is 1
  double max_error_m = 0.0;      ///< largest distance over all vertices and frames, meters

  Eigen::Index Size() const { return directions.cols(); }
};

/// The fewest principal directions of v_p - v_s, in order of what they explain, that keep every
/// vertex of every frame within `tolerance_m` (meters, positive), or `max_directions` if more would
/// be needed: `max_error_m` says how far off that is. Long clips are sampled evenly to find the
/// directions; all frames are projected onto them and counted in the error. K = 0 for a clip
/// without correctives. The result does not depend on `threads`.
CorrectiveBasis ComputeCorrectiveBasis(const BodySurface& surface, const Clip& clip,
                                       double tolerance_m, int max_directions, int threads = 1);

/// The same surface with every coefficient in [0, 1], the range of a morph target's weight in
/// programs that clamp it: the least share of each direction goes into `rest`, directions are
/// scaled, and one whose coefficient never changes is `rest`'s altogether.
CorrectiveBasis WithUnitWeights(const CorrectiveBasis& basis);

}  // namespace holdfast
