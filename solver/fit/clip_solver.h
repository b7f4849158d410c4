// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/fit_options.h"

namespace holdfast {

/// One hold: a hand keeps the object from a frame to another one.
struct ClipHold {
  int hand = 0;            ///< place in the list of hands
  int begin = 0, end = 0;  ///< frames [begin, end)
  /// The hand in the object's frame as it takes hold (3 x N, meters): D and S, or what touches.
  /// Empty: nothing of that is kept, it only stays out of the object.
  Eigen::Matrix3Xd at;
  bool slip = false;  ///< E_s in place of E_d and E_c
};

/// What is asked of the object in one frame besides what hands do to it.
struct FrameGoal {
  std::optional<ObjectPose> data;        ///< near this; weight FitOptions::lambda_object
  std::optional<ObjectPose> rest;        ///< lies here; weight FitOptions::lambda_support
  std::optional<double> support_height;  ///< and no lower than this (world z), same weight
};

/// A whole clip to be solved at once.
struct ClipProblem {
  const Clip& source;  ///< its wrists and fingers are the hands' own
  std::span<const HandModel* const> hands;
  const FitObject& object;
  std::vector<ClipHold> holds;
  std::vector<FrameGoal> goals;    ///< T, or empty
  bool first_frame_given = false;  ///< the first frame is not solved
  /// Objects stay where `fitted` has them, and hands are adjusted as a whole, smoothly.
  bool hands_give_way = false;
};

struct ClipReport {
  double cost_before = 0.0, cost_after = 0.0;  ///< half the weighted sum of all terms
  int iterations = 0;
  bool converged = false;
  bool failed = false;  ///< not finite: nothing was changed
  double solve_ms = 0.0;
  std::vector<Energies> frames;  ///< at the end; E_t is not among them
};

/// Solves object poses, the fingers of the hands that hold, and the wrists' offsets where two hold,
/// of all frames in one sparse problem, from `fitted` (T frames), which it improves. The terms are
/// those of the fit frame by frame, E_t with both of its frames unknown, and in addition little
/// change of velocity, of the object as seen from the wrist that carries it:
///
///   E_a = sum_t |T'_{t+1} - 2 T'_t + T'_{t-1}|^2 + l^2 |turn'_{t+1} - turn'_t|^2
///         + l^2 |P_{t+1} - 2 P_t + P_{t-1}|^2,   l = 0.1 m
///
/// Frames that no hand holds and nothing is asked of are not solved.
///
/// Hands are evaluated on up to `threads` threads, each with one hand of either side, whatever the
/// number of frames; a frame costs about 0.15 MB in the linear system. The result does not depend
/// on `threads`. `progress` (iterations done, at most) may be empty and stops by returning false.
ClipReport SolveClip(const ClipProblem& problem, const FitOptions& options, int threads,
                     std::vector<FittedFrame>& fitted,
                     const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
