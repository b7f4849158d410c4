// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/signed_distance.h"

namespace holdfast {

/// Contact of a hand with an object in one frame, in the object's coordinate frame.
struct Touch {
  std::vector<int> vertices;  ///< touching hand vertices, ascending
  Eigen::Matrix3Xd at;        ///< positions of those vertices, meters (3 x n)
  Eigen::Matrix3Xd on;        ///< the nearest point of the object to each, meters (3 x n)
};

/// Returns the touching vertices: those with signed distance below `threshold_m`, including those
/// inside. `queries` holds the object's signed-distance result for each column of
/// `hand_vertices_in_object`.
Touch FindTouch(const Eigen::Matrix3Xd& hand_vertices_in_object,
                std::span<const SignedDistance::Result> queries, double threshold_m);

/// Change of contact from one frame to the next.
struct ContactStep {
  /// |A and B| / |A or B| of the vertices touching before (A) and now (B); none if both are empty.
  std::optional<double> iou;
  /// Mean slip of the vertices that touch in both frames; none if there are no such vertices.
  std::optional<double> slip_mm;
};

/// Contact over a clip. The slip of a vertex is the smaller of two displacements in the object's
/// frame: that of the vertex, and that of the nearest surface point. Neither pressing in (the
/// surface point stays) nor a change of the nearest side of a thin wall (the vertex stays) counts
/// as slip. A hand that carries the object rigidly has none; sliding along a plane counts in full.
struct ContactTrack {
  std::vector<ContactStep> steps;   ///< one per frame (T); the first is empty
  std::optional<double> mean_iou;   ///< mean over the steps that have one
  std::optional<double> mean_slip;  ///< mm per frame, mean over the steps that have one
  std::optional<double> max_slip;   ///< mm per frame, of any vertex in any step
  /// A vertex's drift is the largest displacement, mm, from where its contact began, during an
  /// uninterrupted contact; the maximum over its contacts. Over the vertices that touch in two
  /// consecutive frames.
  std::optional<double> mean_drift;
  std::optional<double> max_drift;
  std::vector<std::optional<double>> drift_mm;  ///< per frame, mean over the touching vertices
};

/// `counts` flags the frames to include (empty: all). A step needs both of its frames, and contact
/// restarts after an excluded frame. Throws Error if the lengths differ.
ContactTrack TrackContact(std::span<const Touch> frames, std::span<const std::uint8_t> counts = {});

}  // namespace holdfast
