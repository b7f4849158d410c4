// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/foot_lock.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// One foot on the ground for the frames [begin, end).
struct Stance {
  Side side = Side::kRight;
  int begin = 0;
  int end = 0;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< between heel and ball, halfway; meters

  int Frames() const { return end - begin; }
};

/// All stances, of the right foot first, by time. A foot is on the ground while its heel or its
/// ball is (FindContacts). `contacts` and `soles` are one per frame.
std::vector<Stance> FindStances(std::span<const SoleBits> contacts, std::span<const Soles> soles);

/// From where a foot stood to where it stands next.
struct Stride {
  Side side = Side::kRight;
  int lift_off = 0;      ///< first frame in the air
  int touch_down = 0;    ///< first frame on the ground again
  double length_m = 0;   ///< along the ground
  double height_m = 0;   ///< highest above z = 0 that the higher of heel and ball comes on the way
  double duration_s = 0; /**< from the touch-down before to this one; NaN when the motion began
                              after that */
};

/// Strides of at least `shortest_m`: a foot put down where it was makes no way.
std::vector<Stride> FindStrides(std::span<const Stance> stances, std::span<const Soles> soles,
                                double frame_rate, double shortest_m = 0.3);

/// How far each sole point goes along the ground, at most, from where its contact began, meters:
/// one number for each contact of a heel or ball.
std::vector<double> ContactDrifts(std::span<const SoleBits> contacts, std::span<const Soles> soles);

}  // namespace holdfast
