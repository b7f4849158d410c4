// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/handover/holds.h"

namespace holdfast {

/// Interval in which two hands are together: fractional frames, [begin, end].
struct Dwell {
  double begin = 0.0, end = 0.0;
  double Middle() const { return 0.5 * (begin + end); }
};

/// Finds when the hands come together and part, near a first guess. `between` (3 x T): displacement
/// from one hand's holding point to the other's, meters, with any noise; constant while both hold
/// one object. Least-squares fit over the guess and `kAround_s` on either side of
///
///   between(t) = p + a m((begin - t) / A) + b m((t - end) / B),   m minimum jerk (MinimumJerk),
///
/// over begin and end in half frames, and A and B between 0.4 and 1.1 s; p, a and b follow
/// linearly. A distance threshold would detect them late when hands part slowly and noise is large.
/// Returns the guess if there are too few frames.
Dwell FitDwell(const Eigen::Matrix3Xd& between, double frame_rate, const Dwell& guess);

/// The frame nearest to the middle of the interval in which both hands hold, by FitDwell from the
/// frames in which they do in `change`.
int DwellMiddle(const Eigen::Matrix3Xd& between, double frame_rate, const HandSwitch& change);

/// Most likely state sequence and the posterior of each of its steps.
struct StatePath {
  std::vector<int> states;    ///< T states
  Eigen::MatrixXd posterior;  ///< (S x T) state probabilities per step; columns sum to 1
  double cost = 0.0;          ///< of the sequence, nats
};

/// Viterbi algorithm: returns the path with minimum sum of `costs` (S x T, negative
/// log-likelihoods, nats; infinity forbids) and of `change(from, to)` (S x S, nats) between steps.
/// The posterior is that of the hidden Markov model with these costs (forward-backward). Ties go to
/// the lower state. Zero steps give an empty path.
StatePath ViterbiPath(const Eigen::MatrixXd& costs, const Eigen::MatrixXd& change);

/// Known facts and settings for finding where an object changes hands.
struct HandoverSearchOptions {
  std::optional<Side> first_hand;  ///< holds it in the first frame; none: to be inferred
  /// Frames of the switches, ascending: used as given, without a search.
  std::vector<int> switch_frames;
  int min_switches = 1;
  int max_switches = 8;
  double reach_m = 0.15;  ///< maximum distance of the hands beyond the object's width
  /// Nats for a switch with the hands as near and still as possible. Negative: such a meeting is
  /// more likely a handover than not, unless the hands' activity before and after contradicts it.
  double switch_cost = -2.0;
  double activity_weight = 2.5;  ///< nats per second for the more active hand
  double dwell_s = 0.3;          ///< duration in which both hold around a given switch
};

/// Finds where an object changes hands in a clip without an object track: where the hands are
/// nearest, hardly move relative to each other, and the other hand is more active afterwards (after
/// Ghosh et al. 2023, section 5.7, which only says "the most likely frame"). Optimized over the
/// whole clip by dynamic programming; the hands must part between two switches. The switch frame is
/// the middle of the interval in which the hands are together. An active hand is raised and moves
/// relative to the trunk.
///
/// The confidence of a switch is its probability relative to the best explanation of the clip
/// without it. `object_size_m` is the object's median extent (of three). Throws Error for frames
/// out of range or not ascending, min_switches above max_switches, a clip of fewer than two frames,
/// and hands that never come within reach although a switch is required; that message names
/// --switch.
HoldLabels FindHandovers(const Clip& clip, const HandModel& right, const HandModel& left,
                         double object_size_m, const HandoverSearchOptions& options = {});

}  // namespace holdfast
