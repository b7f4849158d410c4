// SPDX-License-Identifier: MIT
#pragma once

/// What Ceres solves for, and the interfaces through which terms see it. Captured frames and hands
/// go in; parameter blocks, their manifolds and changed frames come out.
///
/// From the inside out:
///   quiet_ceres.h        no messages, exit 1 instead of abort
///   stop_when_asked.h    progress of a solve, and its end when asked
///   rotation_manifold.h  unit quaternions as SO(3), tangent in radians
///   vertex_term.h        terms of hand vertices, in Gauss-Newton form
///   skin_term.h          terms with a row per skin point
///   sparse_solve.h       Ceres with sparse Cholesky, for all frames of a clip
///   dense_minimizer.h    least squares of one frame, from normal equations
///   wrist_offset.h       a hand moved off the clip's wrist
///   upper_body_chain.h   trunk, arm and head: 28 changes a frame
///   change_spline.h      those changes over time, a cubic B-spline
///   free_pose.h          a pose some of whose joints are free, with shape
#include "solver/unknowns/change_spline.h"
#include "solver/unknowns/dense_minimizer.h"
#include "solver/unknowns/free_pose.h"
#include "solver/unknowns/quiet_ceres.h"
#include "solver/unknowns/rotation_manifold.h"
#include "solver/unknowns/skin_term.h"
#include "solver/unknowns/sparse_solve.h"
#include "solver/unknowns/stop_when_asked.h"
#include "solver/unknowns/vertex_term.h"
