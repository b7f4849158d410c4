// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/parallel.h"

namespace holdfast {

struct SmoothOptions {
  double cutoff_hz = 5.0;  ///< at which a motion keeps half of its size
  bool pin_feet = true;
  int threads = 1;  ///< the result does not depend on it
};

/// Measures of a motion.
struct BodyJitter {
  double jerk_m_s3 = 0.0;   ///< mean over frames and joints 0..21
  double skate_mm_s = 0.0;  ///< mean speed along the ground of soles in contact
};

struct SmoothReport {
  BodyJitter before, after;
  double moved_mm = 0.0;  ///< root mean square over frames and joints 0..21
  int outliers = 0;       ///< rotations, and positions of the pelvis, off by more than the noise
  bool feet_pinned = false;
  double max_foot_correction_m = 0.0;
  std::vector<std::string> notes;
};

struct SmoothedBody {
  Clip clip;
  SmoothReport report;
};

/// Smooths the motion of a body, such as an estimator's, without lag. Of each joint, Ceres
/// minimizes
///
///   sum_t rho(|log(q0_t^-1 q_t)|^2) + lambda |log(q_t^-1 q_t+1) - log(q_t-1^-1 q_t)|^2
///
/// and the same of the pelvis's position, where lambda gives the cut-off (a Whittaker smoother:
/// half of the size at 2 sin(pi f / rate) = lambda^(-1/4)). rho is Cauchy's loss at three times the
/// noise, which is measured, so that single frames that are far off do not count. Then feet in
/// contact with the ground are pinned (FindSupports, LockFeet); not if they are hardly ever there.
///
/// Throws Error for a clip with an object, of a hand alone, of fewer than three frames, and for a
/// cut-off above half of the frame rate.
SmoothedBody SmoothBody(const Clip& clip, const ClipBody& body, const SmoothOptions& options,
                        const std::string& where, const StagedProgress& progress = {});

}  // namespace holdfast
