// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "solver/grasp/grasp_handle.h"
#include "solver/grasp/grasp_placement.h"

namespace holdfast {

/// A finger's three joints and its tip (3 x 4) in the frame of `state`.
Eigen::Matrix<double, 3, 4> FingerChain(const HandAxes& axes, const HandState& state, int finger);

/// Fingers that pass through a handle's opening.
std::array<bool, kNumFingers> FingersThrough(const HandAxes& axes, const HandState& state,
                                             const Handle& handle,
                                             const Eigen::Isometry3d& wrist_from_object);

/// Puts a hand to a handle with its fingers already through: a hand that closes from outside never
/// gets there, since the body of a mug stops fingertips on their way round the bar. Each finger
/// chooses, by itself but much like its neighbor, from a set of curls worked out once: through the
/// opening and on the bar if that is free, else outside. Const and shared by threads.
class HandlePlacer {
 public:
  explicit HandlePlacer(const HandAnatomy& anatomy);

  /// The best hands at handles[index], for each way of turning about the bar that has anything
  /// through, slightly open: CloseFingers tightens them. `index` becomes Placement::handle.
  std::vector<Placement> Place(std::span<const Handle> handles, int index,
                               const DistanceGrid& object) const;

 private:
  struct Ball {
    Eigen::Vector3d center, pad;  // pad: where the touching side faces
    double radius;
    int phalanx;
  };
  struct Curl {
    std::array<double, 3> flexion, abduction;
    std::vector<Ball> balls;
    Eigen::Matrix3Xd chain;  // as FingerChain's
    double discomfort;
  };
  struct Fit {
    double worth = -1e9;  // not free: the least
    bool through = false;
  };

  static constexpr int kCurls = 25;  // of each finger but the thumb
  using Fits = std::array<std::array<Fit, kCurls>, kThumb>;
  // One curl a finger, from the index finger on.
  struct Choice {
    double worth;
    std::array<int, kThumb> curls;
  };
  class Gaps;

  Curl Posed(HandEvaluation& hand, const HandAngles& angles, int finger) const;
  // The most that each finger, from the index finger on, may be worth, wherever it touches.
  using MostByFinger = std::array<double, kThumb>;
  MostByFinger MostOfFingers(const Handle& handle_in_wrist) const;
  bool KnucklesOutside(const Handle& handle_in_wrist) const;
  static Fit TryFinger(const Curl& curl, const Handle& handle_in_wrist, Gaps& gaps);
  static double TryThumb(const Curl& curl, const Handle& handle, Gaps& gaps);
  Choice Choose(const Fits& fits) const;
  bool TryFingers(const Handle& handle, const DistanceGrid& object, double palm, double least,
                  const MostByFinger& most_of, Placement& placement) const;
  bool TryHand(const Handle& handle, const DistanceGrid& object, double least,
               const MostByFinger& most_of, Placement& placement) const;
  std::vector<Placement> PlaceTurned(std::span<const Handle> handles, int index, double sign,
                                     double angle, const DistanceGrid& object) const;

  const HandAnatomy& anatomy_;
  std::array<std::vector<Curl>, kNumFingers> curls_;
  // What it takes from the worth that a finger, from the index finger on, and the one before it
  // have these curls.
  std::array<std::array<std::array<double, kCurls>, kCurls>, kThumb> unlike_{};
  Eigen::Matrix3Xd palm_;  // points all over palm and back of the hand
  PointPatches palm_patches_;
};

}  // namespace holdfast
