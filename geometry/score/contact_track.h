// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/signed_distance.h"

namespace holdfast {

/// Where a hand touches an object in one frame, all in the object's coordinate frame.
struct Touch {
  std::vector<int> vertices;  ///< touching hand vertices, ascending
  Eigen::Matrix3Xd at;        ///< where those vertices are, meters (3 x n)
  Eigen::Matrix3Xd on;        ///< the point of the object nearest to each, meters (3 x n)
};

/// Vertices touch when their signed distance is below `threshold_m`: those inside touch too.
/// `queries` holds the answer of the object's signed distance for each column of
/// `hand_vertices_in_object`.
Touch FindTouch(const Eigen::Matrix3Xd& hand_vertices_in_object,
                std::span<const SignedDistance::Result> queries, double threshold_m);

/// What contact does from one frame to the next.
struct ContactStep {
  /// |A and B| / |A or B| of the touching vertices A before and B now; nothing when both are empty.
  std::optional<double> iou;
  /// Mean travel of the vertices that touch in both frames; nothing when there are none.
  std::optional<double> slip_mm;
};

/// Contact over a clip. Travel is the lesser of two ways in the object's frame: that of the hand's
/// vertex, and that of the point of the surface nearest to it. So neither pressing in (the touched
/// point stays) nor a nearest side that changes in a thin wall (the vertex stays) is a slip; a hand
/// that carries the object rigidly has none, and one that slides along a plane has its way.
struct ContactTrack {
  std::vector<ContactStep> steps;   ///< T of them; the first has nothing
  std::optional<double> mean_iou;   ///< mean over the steps that have one
  std::optional<double> mean_slip;  ///< mm per frame, mean over the steps that have one
  std::optional<double> max_slip;   ///< mm per frame, of any vertex in any step
  /// A vertex's drift is the greatest travel, mm, from where its contact began, while it lasts
  /// without a gap; of several contacts the greatest. Over the vertices that touch for two frames
  /// in a row.
  std::optional<double> mean_drift;
  std::optional<double> max_drift;
  std::vector<std::optional<double>> drift_mm;  ///< per frame, of the vertices touching, the mean
};

/// `counts` tells the frames that count (empty: all): a step needs both of its frames, and contact
/// begins anew after a frame that does not. Throws Error when the lengths differ.
ContactTrack TrackContact(std::span<const Touch> frames, std::span<const std::uint8_t> counts = {});

}  // namespace holdfast
