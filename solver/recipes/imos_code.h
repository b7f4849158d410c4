// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit.h"

namespace holdfast {

/// The algorithm of IMoS's released code, which differs from the paper (for which see FitClip with
/// FitOptions::OnlyPaper): first the object, from all pair distances with a fixed hand; then the
/// fingers, by 160 Adam steps against a fixed object. For comparison.
///
/// Preserved: the residuals of both stages, their starts, what is fixed, Adam with moments kept
/// between frames, the strided sample of the contact term, its current distances, the unused last
/// step, one hand even if two hold.
///
/// Not preserved: single precision and finite differences in the first stage (same optimum); object
/// rotations that act on row vectors; its first start, which pairs the object's rotation with the
/// body's translation; the other hand's vertices against the first one's D when the hand changes.
struct ImosCodeOptions {
  /// Number of frames whose object poses and fingers are given by the clip; the reference frame for
  /// D is chosen among them. 1 for Holdfast's clips, 4 for the authors'.
  int given_frames = 1;
  double tolerance = 1e-8;      ///< of cost, step and gradient, in the first stage
  int max_iterations = 100;     ///< of the first stage (theirs: 600 evaluations, 7 per iteration)
  int finger_steps = 160;       ///< of Adam, per frame
  double learning_rate = 5e-3;  ///< at the first step of a frame
  double learning_rate_decay = 0.99999;  ///< per step
  double lambda_contact = 0.005;         ///< on the mean distance of pairs in contact
  double lambda_drift = 0.005;  ///< on the fingers' mean squared displacement from their start
  double contact_threshold_m = 0.01;  ///< tau
};

/// Returns the reference frame of D: the last given one before the object moves by 1 mm, or the
/// last but one if it does not. (The code tests a signed difference along any axis, which ignores
/// upward motion; the distance is meant.)
int ImosReferenceFrame(const ObjectTrack& track, int given_frames);

/// Returns the hand that the code fits: the right one if it holds in all frames or in the fourth,
/// else the left; the right one if the clip does not specify.
Side ImosCodeSide(const Clip& clip);

/// First stage, one frame: minimizes over the object pose, from `pose`,
///   1/2 sum_ij ( |R o_j + T - v_i| - D_ij )^2
/// for the hand vertices of `state`. `distance` has weight 1. Returns the iterations, or -1 without
/// a usable solution (`pose` is then the start).
int FitImosObject(HandState& state, const HandObjectDistance& distance,
                  const ImosCodeOptions& options, ObjectPose& pose);

/// Fits the object in all frames by this algorithm. Arguments, result and errors as for FitClip
/// with one hand; for comparison, energies are the paper's, with its weights, at the solution.
FitResult FitClipImosCode(const Clip& clip, const HandModel& hand,
                          const Eigen::Matrix3Xd& object_vertices,
                          const ImosCodeOptions& options = {},
                          const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
