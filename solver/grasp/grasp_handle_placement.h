// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "solver/grasp/grasp_handle.h"
#include "solver/grasp/grasp_placement.h"

namespace holdfast {

/// Positions of a finger's three joints and tip (3 x 4) in the frame of `state`.
Eigen::Matrix<double, 3, 4> FingerChain(const HandAxes& axes, const HandState& state, int finger);

/// Which fingers pass through a handle's opening.
std::array<bool, kNumFingers> FingersThrough(const HandAxes& axes, const HandState& state,
                                             const Handle& handle,
                                             const Eigen::Isometry3d& wrist_from_object);

/// Places a hand on a handle with its fingers already through the opening. A hand that closes from
/// outside cannot get there: the body of a mug stops the fingertips on their way around the bar.
/// Each finger selects one of a precomputed set of curls, with a penalty for curls unlike its
/// neighbor's: a curl through the opening and on the bar if that is free, else one outside. Const
/// and shared by threads.
class HandlePlacer {
 public:
  explicit HandlePlacer(const HandAnatomy& anatomy);

  /// Returns the best hands at handles[index] for each rotation about the bar that has a finger
  /// through, slightly open: CloseFingers tightens them. `index` becomes Placement::handle.
  std::vector<Placement> Place(std::span<const Handle> handles, int index,
                               const DistanceGrid& object) const;

 private:
  struct Ball {
    Eigen::Vector3d center, pad;  // pad: direction of the touching side
    double radius;
    int phalanx;
  };
  struct Curl {
    std::array<double, 3> flexion, abduction;
    std::vector<Ball> balls;
    Eigen::Matrix3Xd chain;  // see FingerChain
    double discomfort;
  };
  struct Fit {
    double worth = -1e9;  // lowest value: not free
    bool through = false;
  };

  static constexpr int kCurls = 25;  // per finger except the thumb
  using Fits = std::array<std::array<Fit, kCurls>, kThumb>;
  class Gaps;

  Curl Posed(HandEvaluation& hand, const HandAngles& angles, int finger) const;
  // Upper bound on the worth of each finger, from the index finger on, wherever it touches.
  using MostByFinger = std::array<double, kThumb>;
  MostByFinger MostOfFingers(const Handle& handle_in_wrist) const;
  bool KnucklesOutside(const Handle& handle_in_wrist) const;
  static Fit TryFinger(const Curl& curl, const Handle& handle_in_wrist, Gaps& gaps);
  static double TryThumb(const Curl& curl, const Handle& handle, Gaps& gaps);
  // Worth and one curl per finger, from the index finger on.
  std::pair<double, std::array<int, kThumb>> Choose(const Fits& fits) const;
  bool TryFingers(const Handle& handle, const DistanceGrid& object, double palm, double least,
                  const MostByFinger& most_of, Placement& placement) const;
  std::vector<Placement> PlaceTurned(std::span<const Handle> handles, int index, double sign,
                                     double angle, const DistanceGrid& object) const;

  const HandAnatomy& anatomy_;
  std::array<std::vector<Curl>, kNumFingers> curls_;
  // Penalty for a finger (from the index finger on) and the finger before it having these curls.
  std::array<std::array<std::array<double, kCurls>, kCurls>, kThumb> unlike_{};
  Eigen::Matrix3Xd palm_;  // points sampled over palm and back of the hand
  PointPatches palm_patches_;
};

}  // namespace holdfast
