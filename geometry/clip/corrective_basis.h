// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Low-rank basis of the pose correctives of one clip: what a skinned mesh with morph targets needs
/// to show the body model's surface instead of plain linear blend skinning.
///
///     v_p(t) = rest + sum_k coefficients(k, t) directions_k      (within max_error_m)
///
/// v(t) follows from v_p(t) by the model's ordinary skinning.
struct CorrectiveBasis {
  Eigen::Matrix3Xd rest;       ///< v_s (3 x V), rest pose, meters
  Eigen::MatrixXf directions;  ///< (3V x K) meters, one direction per column: x y z of each vertex
  Eigen::MatrixXf coefficients;  ///< (K x T), each row's largest magnitude is 1
  double max_error_m = 0.0;      ///< largest distance over all vertices and frames, meters

  Eigen::Index Size() const { return directions.cols(); }
};

/// Computes the smallest number of principal directions of v_p - v_s, in order of explained
/// variance, that keeps every vertex of every frame within `tolerance_m` (meters, positive), or
/// `max_directions` if more would be needed; `max_error_m` is the resulting error. For long clips
/// the directions are computed from evenly sampled frames; all frames are projected and included in
/// the error. K = 0 for a clip without correctives. The result does not depend on `threads`.
CorrectiveBasis ComputeCorrectiveBasis(const BodySurface& surface, const Clip& clip,
                                       double tolerance_m, int max_directions, int threads = 1);

/// Returns the same surface with every coefficient in [0, 1], the morph weight range of programs
/// that clamp. The minimum of each direction is added to `rest`, and directions are scaled; a
/// direction with a constant coefficient becomes part of `rest`.
CorrectiveBasis WithUnitWeights(const CorrectiveBasis& basis);

}  // namespace holdfast
