// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit.h"

namespace holdfast {

/// What the released code of IMoS does, which is not what the paper says (FitClip with
/// FitOptions::OnlyPaper is): the object first, by all pair distances and a hand held still; then
/// the fingers, by 160 steps of Adam against an object held still. Made for comparisons.
///
/// Kept: the residuals of both stages, where each starts, what is held, Adam with its moments
/// carried on from frame to frame, the strided sample of the contact term, its current distances,
/// the last step that nobody uses, one hand even when two hold.
///
/// Not kept: single precision and finite differences in the first stage (its optimum is the same);
/// rotations of objects that act on row vectors; the first start there, which pairs the object's
/// rotation with the body's translation; the other hand's vertices against the first one's D, where
/// the hand changes.
struct ImosCodeOptions {
  /// Frames whose object poses and fingers are given by the clip; the reference frame for D is
  /// chosen among them. 1 for Holdfast's clips, 4 for the authors'.
  int given_frames = 1;
  double tolerance = 1e-8;      ///< of cost, step and gradient, in the first stage
  int max_iterations = 100;     ///< of the first stage (theirs: 600 evaluations, 7 an iteration)
  int finger_steps = 160;       ///< of Adam, per frame
  double learning_rate = 5e-3;  ///< at a frame's first step
  double learning_rate_decay = 0.99999;  ///< per step
  double lambda_contact = 0.005;         ///< on the mean distance of pairs in contact
  double lambda_drift = 0.005;           ///< on the fingers' mean squared way from their start
  double contact_threshold_m = 0.01;     ///< tau
};

/// The frame that D comes from: the last given one before the object moves by 1 mm, and if it does
/// not, the last but one. (The code asks for a signed difference along any axis, so that a rise
/// does not count; the distance is meant.)
int ImosReferenceFrame(const ObjectTrack& track, int given_frames);

/// The hand that the code fits: the right one if it holds in all frames or in the fourth, else the
/// left; the right one where the clip does not say.
Side ImosCodeSide(const Clip& clip);

/// First stage, one frame: the pose that minimizes
///   1/2 sum_ij ( |R o_j + T - v_i| - D_ij )^2
/// for hand vertices `state` is at, from `start`. `distance` has weight 1. Returns the iterations,
/// or -1 if there was no usable solution (`pose` is then the start).
int FitImosObject(HandState& state, const HandObjectDistance& distance,
                  const ImosCodeOptions& options, ObjectPose& pose);

/// Carries the object through a clip by that recipe. Arguments, result and errors as FitClip for
/// one hand; energies are the paper's with its weights, at what was found, so that they compare.
FitResult FitClipImosCode(const Clip& clip, const HandModel& hand,
                          const Eigen::Matrix3Xd& object_vertices,
                          const ImosCodeOptions& options = {},
                          const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
