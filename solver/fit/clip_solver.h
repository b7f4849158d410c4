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

/// One hold: a hand holds the object during an interval of frames.
struct ClipHold {
  int hand = 0;            ///< index into the list of hands
  int begin = 0, end = 0;  ///< frames [begin, end)
  /// The hand in the object frame at the start of the hold (3 x N, meters): gives D and S, or
  /// contacts. Empty: no relation is kept; the hand only stays out of the object.
  Eigen::Matrix3Xd at;
  bool slip = false;  ///< E_s instead of E_d and E_c
};

/// Goals for the object in one frame, besides the hands' terms.
struct FrameGoal {
  std::optional<ObjectPose> data;        ///< target pose; weight FitOptions::lambda_object
  std::optional<ObjectPose> rest;        ///< resting pose; weight FitOptions::lambda_support
  std::optional<double> support_height;  ///< minimum height (world z), same weight
};

/// A whole clip to be solved jointly.
struct ClipProblem {
  const Clip& source;  ///< gives the hands' wrists and fingers
  std::span<const HandModel* const> hands;
  const FitObject& object;
  std::vector<ClipHold> holds;
  std::vector<FrameGoal> goals;    ///< T entries, or empty
  bool first_frame_given = false;  ///< the first frame is fixed
  /// Objects stay at their poses in `fitted`; hands are adjusted as a whole, smoothly.
  bool hands_give_way = false;
};

struct ClipReport {
  double cost_before = 0.0, cost_after = 0.0;  ///< half the weighted sum of all terms
  int iterations = 0;
  bool converged = false;
  bool failed = false;  ///< not finite: nothing was changed
  double solve_ms = 0.0;
  std::vector<Energies> frames;  ///< final energies, without E_t
};

/// Solves the object poses, the fingers of holding hands, and the wrist offsets where two hands
/// hold, of all frames in one sparse problem, from the initial values in `fitted` (T frames), which
/// it updates. The terms are those of the frame-by-frame fit, E_t with both frames unknown, plus
/// the acceleration of the object relative to the wrist that carries it:
///
///   E_a = sum_t |T'_{t+1} - 2 T'_t + T'_{t-1}|^2 + l^2 |turn'_{t+1} - turn'_t|^2
///         + l^2 |P_{t+1} - 2 P_t + P_{t-1}|^2,   l = 0.1 m
///
/// Frames without a holding hand and without goals are not solved.
///
/// Hands are evaluated on up to `threads` threads, each with one hand of either side; a frame takes
/// about 0.15 MB in the linear system. The result does not depend on `threads`. `progress`
/// (iterations done, maximum) may be empty; returning false stops the solve.
ClipReport SolveClip(const ClipProblem& problem, const FitOptions& options, int threads,
                     std::vector<FittedFrame>& fitted,
                     const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
